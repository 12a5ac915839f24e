//! Instances of FMI 3.0.

use std::cell::Cell;
use std::ffi::{CString, c_char, c_void};
use std::ptr;
use std::sync::Arc;

use fmi_sys::fmi3::Fmi3Binding;

use super::log::{self, Log};
use super::status::{self, Fault, Status};
use super::{Identity, Stepped, Update};
use crate::import::{Value, VariableKind};

/// A live instance; freed when dropped.
pub(crate) struct Instance {
    pointer: *mut c_void,
    lost: Cell<bool>,
    log: Box<Log>,
    // last: closed, if nobody else uses it, after the instance is freed
    library: Arc<Fmi3Binding>,
}

/// A state saved by its instance.
pub(crate) struct Saved(*mut c_void);

/// Calls a function of the instance and checks the status.
macro_rules! call {
    ($self:ident.$name:ident($($argument:expr),* $(,)?)) => {{
        let Ok(function) = &$self.library.$name else {
            return Err(Fault { function: stringify!($name), status: Status::Missing });
        };
        if $self.lost.get() {
            return Err(Fault { function: stringify!($name), status: Status::Fatal });
        }
        // SAFETY: the instance is live and not lost; arrays are passed with their lengths, results go to variables of
        // their types (Booleans to bytes, so that any byte may come back), and all live during the call.
        let code = unsafe { function($self.pointer, $($argument),*) };
        $self.check(stringify!($name), code)
    }};
}

/// Room for a Boolean that the FMU writes.
fn flag(byte: &mut u8) -> *mut bool {
    ptr::from_mut(byte).cast()
}

impl Instance {
    /// An instance for Co-Simulation, with Event Mode if `events`.
    pub(crate) fn co_simulation(
        library: &Arc<Fmi3Binding>,
        identity: &Identity<'_>,
        events: bool,
    ) -> Result<Self, (Fault, Vec<String>)> {
        let function = "fmi3InstantiateCoSimulation";
        let Ok(instantiate) = &library.fmi3InstantiateCoSimulation else {
            return Err((Fault { function, status: Status::Missing }, vec![]));
        };
        Self::new(library, identity, function, |name, token, resources, environment| {
            // SAFETY: all strings end with a zero byte and live during the call; the environment outlives the instance;
            // no intermediate variables are asked for, so there is no callback for them.
            unsafe {
                instantiate(
                    name,
                    token,
                    resources,
                    false,
                    false,
                    events,
                    false,
                    ptr::null(),
                    0,
                    environment,
                    Some(log::message),
                    None,
                )
            }
        })
    }

    /// An instance for Model Exchange.
    pub(crate) fn model_exchange(
        library: &Arc<Fmi3Binding>,
        identity: &Identity<'_>,
    ) -> Result<Self, (Fault, Vec<String>)> {
        let function = "fmi3InstantiateModelExchange";
        let Ok(instantiate) = &library.fmi3InstantiateModelExchange else {
            return Err((Fault { function, status: Status::Missing }, vec![]));
        };
        Self::new(library, identity, function, |name, token, resources, environment| {
            // SAFETY: as in `co_simulation`.
            unsafe { instantiate(name, token, resources, false, false, environment, Some(log::message)) }
        })
    }

    fn new(
        library: &Arc<Fmi3Binding>,
        identity: &Identity<'_>,
        function: &'static str,
        instantiate: impl FnOnce(*const c_char, *const c_char, *const c_char, *mut c_void) -> *mut c_void,
    ) -> Result<Self, (Fault, Vec<String>)> {
        let refused = |messages| (Fault { function, status: Status::Null }, messages);
        let zero_byte = |_| refused(vec!["a name, token or path holds a zero byte".into()]);
        let name = CString::new(identity.name).map_err(zero_byte)?;
        let token = CString::new(identity.token).map_err(zero_byte)?;
        let folder = format!("{}/", identity.resources.display());
        let resources = CString::new(folder).map_err(zero_byte)?;
        let log = Box::<Log>::default();
        let pointer = instantiate(name.as_ptr(), token.as_ptr(), resources.as_ptr(), log.environment());
        if pointer.is_null() {
            return Err(refused(log.take()));
        }
        Ok(Self { pointer, lost: Cell::new(false), log, library: Arc::clone(library) })
    }

    #[inline]
    fn check(&self, function: &'static str, code: u32) -> Result<(), Fault> {
        let result = status::check(function, code);
        if let Err(Fault { status: Status::Fatal, .. }) = result {
            self.lost.set(true);
        }
        result
    }

    pub(crate) fn messages(&self) -> Vec<String> {
        self.log.take()
    }

    pub(crate) fn enter_initialization(&mut self, start: f64, stop: Option<f64>) -> Result<(), Fault> {
        let (defined, stop) = (stop.is_some(), stop.unwrap_or(0.0));
        call!(self.fmi3EnterInitializationMode(false, 0.0, start, defined, stop))
    }

    pub(crate) fn exit_initialization(&mut self) -> Result<(), Fault> {
        call!(self.fmi3ExitInitializationMode())
    }

    pub(crate) fn enter_event_mode(&mut self) -> Result<(), Fault> {
        call!(self.fmi3EnterEventMode())
    }

    pub(crate) fn enter_step_mode(&mut self) -> Result<(), Fault> {
        call!(self.fmi3EnterStepMode())
    }

    pub(crate) fn enter_continuous_time_mode(&mut self) -> Result<(), Fault> {
        call!(self.fmi3EnterContinuousTimeMode())
    }

    pub(crate) fn terminate(&mut self) -> Result<(), Fault> {
        call!(self.fmi3Terminate())
    }

    pub(crate) fn update_discrete_states(&mut self) -> Result<Update, Fault> {
        let (mut again, mut terminate, mut nominals, mut states, mut defined) = (0, 0, 0, 0, 0);
        let mut next = 0.0;
        call!(self.fmi3UpdateDiscreteStates(
            flag(&mut again),
            flag(&mut terminate),
            flag(&mut nominals),
            flag(&mut states),
            flag(&mut defined),
            &raw mut next,
        ))?;
        Ok(Update {
            again: again != 0,
            terminate: terminate != 0,
            states_changed: states != 0,
            next_event: (defined != 0).then_some(next),
        })
    }

    pub(crate) fn do_step(&mut self, t: f64, h: f64, may_restore: bool) -> Result<Stepped, Fault> {
        let (mut event, mut terminate, mut early) = (0, 0, 0);
        let mut last = t;
        call!(self.fmi3DoStep(
            t,
            h,
            !may_restore,
            flag(&mut event),
            flag(&mut terminate),
            flag(&mut early),
            &raw mut last,
        ))?;
        Ok(Stepped { event: event != 0, terminate: terminate != 0 })
    }

    #[inline]
    pub(crate) fn get_real(&self, references: &[u32], values: &mut [f64]) -> Result<(), Fault> {
        assert_eq!(references.len(), values.len(), "scalar variables");
        let (n, to) = (references.len(), values.as_mut_ptr());
        call!(self.fmi3GetFloat64(references.as_ptr(), n, to, n))
    }

    #[inline]
    pub(crate) fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), Fault> {
        assert_eq!(references.len(), values.len(), "scalar variables");
        let (n, from) = (references.len(), values.as_ptr());
        call!(self.fmi3SetFloat64(references.as_ptr(), n, from, n))
    }

    /// A value of any supported kind, as a number.
    #[allow(clippy::cast_precision_loss, reason = "counters are shown, not computed with")]
    pub(crate) fn get_number(&self, kind: VariableKind, reference: u32) -> Result<f64, Fault> {
        let r = &raw const reference;
        match kind {
            VariableKind::Real => {
                let mut value = 0.0;
                call!(self.fmi3GetFloat64(r, 1, &raw mut value, 1)).map(|()| value)
            }
            VariableKind::Int32 => {
                let mut value = 0;
                call!(self.fmi3GetInt32(r, 1, &raw mut value, 1)).map(|()| f64::from(value))
            }
            VariableKind::Int64 | VariableKind::Enumeration => {
                let mut value = 0;
                call!(self.fmi3GetInt64(r, 1, &raw mut value, 1)).map(|()| value as f64)
            }
            VariableKind::Boolean => {
                let mut value = 0;
                call!(self.fmi3GetBoolean(r, 1, flag(&mut value), 1)).map(|()| f64::from(value != 0))
            }
            VariableKind::String | VariableKind::Other => {
                Err(Fault { function: "fmi3Get{VariableType}", status: Status::Missing })
            }
        }
    }

    /// A start value or parameter.
    pub(crate) fn set_value(
        &mut self,
        kind: VariableKind,
        reference: u32,
        value: &Value,
    ) -> Result<(), Fault> {
        let r = &raw const reference;
        match (kind, value) {
            (VariableKind::Real, Value::Real(v)) => call!(self.fmi3SetFloat64(r, 1, v, 1)),
            (VariableKind::Int32, Value::Integer(v)) => {
                let narrow = i32::try_from(*v)
                    .map_err(|_| Fault { function: "fmi3SetInt32", status: Status::Discard })?;
                call!(self.fmi3SetInt32(r, 1, &raw const narrow, 1))
            }
            (VariableKind::Int64 | VariableKind::Enumeration, Value::Integer(v)) => {
                call!(self.fmi3SetInt64(r, 1, v, 1))
            }
            (VariableKind::Boolean, Value::Boolean(v)) => call!(self.fmi3SetBoolean(r, 1, v, 1)),
            (VariableKind::String, Value::String(v)) => {
                let text = CString::new(v.as_str())
                    .map_err(|_| Fault { function: "fmi3SetString", status: Status::Discard })?;
                let pointer = text.as_ptr();
                call!(self.fmi3SetString(r, 1, &raw const pointer, 1))
            }
            _ => Err(Fault { function: "fmi3Set{VariableType}", status: Status::Missing }),
        }
    }

    #[inline]
    pub(crate) fn set_time(&mut self, t: f64) -> Result<(), Fault> {
        call!(self.fmi3SetTime(t))
    }

    #[inline]
    pub(crate) fn set_states(&mut self, x: &[f64]) -> Result<(), Fault> {
        call!(self.fmi3SetContinuousStates(x.as_ptr(), x.len()))
    }

    pub(crate) fn get_states(&self, x: &mut [f64]) -> Result<(), Fault> {
        call!(self.fmi3GetContinuousStates(x.as_mut_ptr(), x.len()))
    }

    #[inline]
    pub(crate) fn get_derivatives(&self, dx: &mut [f64]) -> Result<(), Fault> {
        call!(self.fmi3GetContinuousStateDerivatives(dx.as_mut_ptr(), dx.len()))
    }

    pub(crate) fn get_nominals(&self, nominals: &mut [f64]) -> Result<(), Fault> {
        call!(self.fmi3GetNominalsOfContinuousStates(nominals.as_mut_ptr(), nominals.len()))
    }

    pub(crate) fn number_of_indicators(&self) -> Result<usize, Fault> {
        let mut n = 0;
        call!(self.fmi3GetNumberOfEventIndicators(&raw mut n)).map(|()| n)
    }

    pub(crate) fn get_indicators(&self, z: &mut [f64]) -> Result<(), Fault> {
        call!(self.fmi3GetEventIndicators(z.as_mut_ptr(), z.len()))
    }

    /// Whether the FMU wants Event Mode, and whether it wants to end.
    pub(crate) fn completed_step(&mut self) -> Result<(bool, bool), Fault> {
        let (mut event, mut terminate) = (0, 0);
        call!(self.fmi3CompletedIntegratorStep(true, flag(&mut event), flag(&mut terminate)))?;
        Ok((event != 0, terminate != 0))
    }

    pub(crate) fn save(&mut self, into: &mut Option<Saved>) -> Result<(), Fault> {
        let mut state = into.as_ref().map_or(ptr::null_mut(), |saved| saved.0);
        call!(self.fmi3GetFMUState(&raw mut state))?;
        *into = Some(Saved(state));
        Ok(())
    }

    pub(crate) fn restore(&mut self, saved: &Saved) -> Result<(), Fault> {
        call!(self.fmi3SetFMUState(saved.0))
    }

    pub(crate) fn forget(&mut self, Saved(mut state): Saved) -> Result<(), Fault> {
        call!(self.fmi3FreeFMUState(&raw mut state))
    }

    /// A saved state as bytes.
    pub(crate) fn serialise(&self, saved: &Saved) -> Result<Vec<u8>, Fault> {
        let mut size = 0;
        call!(self.fmi3SerializedFMUStateSize(saved.0, &raw mut size))?;
        let mut bytes = vec![0; size];
        call!(self.fmi3SerializeFMUState(saved.0, bytes.as_mut_ptr(), size))?;
        Ok(bytes)
    }

    /// A saved state from bytes.
    pub(crate) fn deserialise(&self, bytes: &[u8]) -> Result<Saved, Fault> {
        let mut state = ptr::null_mut();
        call!(self.fmi3DeserializeFMUState(bytes.as_ptr(), bytes.len(), &raw mut state))?;
        Ok(Saved(state))
    }

    pub(crate) fn directional(
        &self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result<(), Fault> {
        assert!(unknowns.len() == out.len() && knowns.len() == seed.len(), "scalar variables");
        call!(self.fmi3GetDirectionalDerivative(
            unknowns.as_ptr(),
            unknowns.len(),
            knowns.as_ptr(),
            knowns.len(),
            seed.as_ptr(),
            seed.len(),
            out.as_mut_ptr(),
            out.len(),
        ))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let (Ok(free), false) = (&self.library.fmi3FreeInstance, self.lost.get()) {
            // SAFETY: the instance is live and not used after this; log and library are dropped after it.
            unsafe { free(self.pointer) }
        }
    }
}
