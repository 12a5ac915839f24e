//! Judging saved states, and their bytes.

#![allow(clippy::unnecessary_wraps, reason = "one type of answer for all calls")]

use fmi_capi::{OK, status_name};

use crate::call::Mutation;
use crate::expect::Expected;
use crate::machine::{Answer, Machine, Record, Store};
use crate::standard::Function;

impl Machine<'_> {
    pub(crate) fn save(&mut self, slot: usize, store: usize) -> Answer {
        let expected = self.rule(slot, Function::FmuState);
        let handle = self.slots[slot].as_ref().map(|slot| &slot.handle);
        let status = self.fmu.api.save(handle, &mut self.stores[store].state);
        if status == OK {
            self.stores[store].known = self.known(slot).cloned();
            self.stores[store].observed = if self.observe { Some(self.observe(slot)?) } else { None };
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }

    pub(crate) fn restore(&mut self, slot: usize, store: usize) -> Answer {
        let mut expected = self.rule(slot, Function::FmuState);
        let Store { state, known: saved, .. } = &self.stores[store];
        let of_this_kind =
            matches!((saved, self.known(slot)), (Some(s), Some(k)) if s.interface == k.interface);
        if !of_this_kind {
            expected = Expected::error();
        }
        let status = self.fmu.api.restore(self.handle(slot), state);
        if status != OK || !of_this_kind {
            return Ok((Record { status, data: Vec::new() }, expected));
        }
        if let (Some(saved), Some(slot)) = (saved.clone(), &mut self.slots[slot]) {
            slot.known = saved;
        }
        if let Some(before) = self.stores[store].observed.clone() {
            let after = self.observe(slot)?;
            if let Some(i) = (0..before.len().max(after.len())).find(|i| before.get(*i) != after.get(*i)) {
                return Err(format!("item {i} of everything that may be read differs after the restore"));
            }
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }

    pub(crate) fn free_state(&mut self, slot: usize, store: usize) -> Answer {
        let expected = self.rule(slot, Function::FmuState);
        let handle = self.slots[slot].as_ref().map(|slot| &slot.handle);
        let status = self.fmu.api.free_state(handle, &mut self.stores[store].state);
        if status == OK {
            if !self.stores[store].state.is_null() {
                return Err("a freed state is not null".into());
            }
            self.stores[store].known = None;
            self.stores[store].observed = None;
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }

    pub(crate) fn serialize(&mut self, slot: usize, store: usize, mutation: Mutation) -> Answer {
        let declared = self.fmu.description.serialises;
        let mut expected = self.rule(slot, Function::FmuState);
        if !declared || self.stores[store].known.is_none() {
            expected = Expected::error();
        }
        let handle = self.handle(slot);
        let surplus = if let Mutation::WrongSize(surplus) = mutation { surplus } else { 0 };
        let (status, mut bytes) = self.fmu.api.serialize(handle, &self.stores[store].state, surplus);
        if surplus != 0 {
            return Ok((Record { status, data: Vec::new() }, Expected::error()));
        }
        if status != OK {
            return Ok((Record { status, data: Vec::new() }, expected));
        }
        let whole = bytes.clone();
        mutation.apply(&mut bytes, &self.fmu.foreign);
        let (status, mut state) = self.fmu.api.deserialize(handle, &bytes);
        if bytes != whole {
            expected = Expected::error();
        }
        if status == OK && state.is_null() || status != OK && !state.is_null() {
            return Err(format!(
                "deserialising is {} and the state's pointer is {state:?}",
                status_name(status)
            ));
        }
        if status == OK {
            std::mem::swap(&mut self.stores[store].state, &mut state);
            let freed = self.fmu.api.free_state(self.handle(slot), &mut state);
            if freed != OK {
                return Err("a state cannot be freed".into());
            }
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }
}
