//! Instances of FMI 2.0.

use std::cell::Cell;
use std::ffi::{CString, c_int, c_void};
use std::fmt::Write as _;
use std::path::Path;
use std::ptr;
use std::sync::Arc;

use fmi_sys::fmi2::{
    Fmi2Binding, fmi2CallbackFunctions, fmi2CallbackLogger, fmi2EventInfo, fmi2Type,
    fmi2Type_fmi2CoSimulation, fmi2Type_fmi2ModelExchange,
};

use super::log::{self, Log};
use super::status::{self, Fault, Status};
use super::{Identity, Stepped, Update};
use crate::import::{Value, VariableKind};

/// A live instance; freed when dropped.
pub(crate) struct Instance {
    pointer: *mut c_void,
    lost: Cell<bool>,
    _callbacks: Box<fmi2CallbackFunctions>,
    log: Box<Log>,
    // last: closed, if nobody else uses it, after the instance is freed
    library: Arc<Fmi2Binding>,
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
        // their types, and all live during the call.
        let code = unsafe { function($self.pointer, $($argument),*) };
        $self.check(stringify!($name), code)
    }};
}

/// A path as the URI that FMI 2.0 asks for.
fn file_uri(path: &Path) -> String {
    let mut uri = String::from("file://");
    for byte in path.display().to_string().bytes() {
        if byte.is_ascii_alphanumeric() || b"/-_.~:".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            let _ = write!(uri, "%{byte:02X}"); // writing to a string does not fail
        }
    }
    uri
}

impl Instance {
    /// An instance for Co-Simulation.
    pub(crate) fn co_simulation(
        library: &Arc<Fmi2Binding>,
        identity: &Identity<'_>,
    ) -> Result<Self, (Fault, Vec<String>)> {
        Self::new(library, identity, fmi2Type_fmi2CoSimulation)
    }

    /// An instance for Model Exchange.
    pub(crate) fn model_exchange(
        library: &Arc<Fmi2Binding>,
        identity: &Identity<'_>,
    ) -> Result<Self, (Fault, Vec<String>)> {
        Self::new(library, identity, fmi2Type_fmi2ModelExchange)
    }

    fn new(
        library: &Arc<Fmi2Binding>,
        identity: &Identity<'_>,
        kind: fmi2Type,
    ) -> Result<Self, (Fault, Vec<String>)> {
        let function = "fmi2Instantiate";
        let refused = |status, messages| (Fault { function, status }, messages);
        let Ok(instantiate) = &library.fmi2Instantiate else {
            return Err(refused(Status::Missing, vec![]));
        };
        let zero_byte = |_| refused(Status::Null, vec!["a name, token or path holds a zero byte".into()]);
        let name = CString::new(identity.name).map_err(zero_byte)?;
        let token = CString::new(identity.token).map_err(zero_byte)?;
        let resources = CString::new(file_uri(identity.resources)).map_err(zero_byte)?;
        let log = Box::<Log>::default();
        // SAFETY: the fixed arguments of a C function with an ellipsis are passed as those of one without it on the
        // platforms of the workspace (x86-64 and AArch64); the others are not read.
        let logger =
            unsafe { std::mem::transmute::<*const (), fmi2CallbackLogger>(log::message_2 as *const ()) };
        let callbacks = Box::new(fmi2CallbackFunctions {
            logger,
            allocateMemory: Some(libc::calloc),
            freeMemory: Some(libc::free),
            stepFinished: None,
            componentEnvironment: log.environment(),
        });
        // SAFETY: all strings end with a zero byte and live during the call; callbacks and log outlive the instance.
        let pointer = unsafe {
            instantiate(name.as_ptr(), kind, token.as_ptr(), resources.as_ptr(), &raw const *callbacks, 0, 0)
        };
        if pointer.is_null() {
            return Err(refused(Status::Null, log.take()));
        }
        let library = Arc::clone(library);
        Ok(Self { pointer, lost: Cell::new(false), _callbacks: callbacks, log, library })
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
        let (defined, stop) = (c_int::from(stop.is_some()), stop.unwrap_or(0.0));
        call!(self.fmi2SetupExperiment(0, 0.0, start, defined, stop))?;
        call!(self.fmi2EnterInitializationMode())
    }

    pub(crate) fn exit_initialization(&mut self) -> Result<(), Fault> {
        call!(self.fmi2ExitInitializationMode())
    }

    pub(crate) fn enter_event_mode(&mut self) -> Result<(), Fault> {
        call!(self.fmi2EnterEventMode())
    }

    pub(crate) fn enter_continuous_time_mode(&mut self) -> Result<(), Fault> {
        call!(self.fmi2EnterContinuousTimeMode())
    }

    pub(crate) fn terminate(&mut self) -> Result<(), Fault> {
        call!(self.fmi2Terminate())
    }

    pub(crate) fn update_discrete_states(&mut self) -> Result<Update, Fault> {
        let mut info = fmi2EventInfo::default();
        call!(self.fmi2NewDiscreteStates(&raw mut info))?;
        Ok(Update {
            again: info.newDiscreteStatesNeeded != 0,
            terminate: info.terminateSimulation != 0,
            states_changed: info.valuesOfContinuousStatesChanged != 0,
            next_event: (info.nextEventTimeDefined != 0).then_some(info.nextEventTime),
        })
    }

    pub(crate) fn do_step(&mut self, t: f64, h: f64, may_restore: bool) -> Result<Stepped, Fault> {
        call!(self.fmi2DoStep(t, h, c_int::from(!may_restore)))?;
        Ok(Stepped::default())
    }

    #[inline]
    pub(crate) fn get_real(&self, references: &[u32], values: &mut [f64]) -> Result<(), Fault> {
        assert_eq!(references.len(), values.len(), "scalar variables");
        call!(self.fmi2GetReal(references.as_ptr(), references.len(), values.as_mut_ptr()))
    }

    #[inline]
    pub(crate) fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), Fault> {
        assert_eq!(references.len(), values.len(), "scalar variables");
        call!(self.fmi2SetReal(references.as_ptr(), references.len(), values.as_ptr()))
    }

    /// A value of any supported kind, as a number.
    pub(crate) fn get_number(&self, kind: VariableKind, reference: u32) -> Result<f64, Fault> {
        let r = &raw const reference;
        let mut integer = 0;
        match kind {
            VariableKind::Real => {
                let mut value = 0.0;
                call!(self.fmi2GetReal(r, 1, &raw mut value)).map(|()| value)
            }
            VariableKind::Int32 | VariableKind::Int64 | VariableKind::Enumeration => {
                call!(self.fmi2GetInteger(r, 1, &raw mut integer)).map(|()| f64::from(integer))
            }
            VariableKind::Boolean => {
                call!(self.fmi2GetBoolean(r, 1, &raw mut integer)).map(|()| f64::from(u8::from(integer != 0)))
            }
            VariableKind::String | VariableKind::Other => {
                Err(Fault { function: "fmi2Get", status: Status::Missing })
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
            (VariableKind::Real, Value::Real(v)) => call!(self.fmi2SetReal(r, 1, v)),
            (VariableKind::Int32 | VariableKind::Int64 | VariableKind::Enumeration, Value::Integer(v)) => {
                let narrow = i32::try_from(*v)
                    .map_err(|_| Fault { function: "fmi2SetInteger", status: Status::Discard })?;
                call!(self.fmi2SetInteger(r, 1, &raw const narrow))
            }
            (VariableKind::Boolean, Value::Boolean(v)) => {
                let wide = c_int::from(*v);
                call!(self.fmi2SetBoolean(r, 1, &raw const wide))
            }
            (VariableKind::String, Value::String(v)) => {
                let text = CString::new(v.as_str())
                    .map_err(|_| Fault { function: "fmi2SetString", status: Status::Discard })?;
                let pointer = text.as_ptr();
                call!(self.fmi2SetString(r, 1, &raw const pointer))
            }
            _ => Err(Fault { function: "fmi2Set", status: Status::Missing }),
        }
    }

    #[inline]
    pub(crate) fn set_time(&mut self, t: f64) -> Result<(), Fault> {
        call!(self.fmi2SetTime(t))
    }

    #[inline]
    pub(crate) fn set_states(&mut self, x: &[f64]) -> Result<(), Fault> {
        call!(self.fmi2SetContinuousStates(x.as_ptr(), x.len()))
    }

    pub(crate) fn get_states(&self, x: &mut [f64]) -> Result<(), Fault> {
        call!(self.fmi2GetContinuousStates(x.as_mut_ptr(), x.len()))
    }

    #[inline]
    pub(crate) fn get_derivatives(&self, dx: &mut [f64]) -> Result<(), Fault> {
        call!(self.fmi2GetDerivatives(dx.as_mut_ptr(), dx.len()))
    }

    pub(crate) fn get_nominals(&self, nominals: &mut [f64]) -> Result<(), Fault> {
        call!(self.fmi2GetNominalsOfContinuousStates(nominals.as_mut_ptr(), nominals.len()))
    }

    pub(crate) fn get_indicators(&self, z: &mut [f64]) -> Result<(), Fault> {
        call!(self.fmi2GetEventIndicators(z.as_mut_ptr(), z.len()))
    }

    /// Whether the FMU wants Event Mode, and whether it wants to end.
    pub(crate) fn completed_step(&mut self) -> Result<(bool, bool), Fault> {
        let (mut event, mut terminate) = (0, 0);
        call!(self.fmi2CompletedIntegratorStep(1, &raw mut event, &raw mut terminate))?;
        Ok((event != 0, terminate != 0))
    }

    pub(crate) fn save(&mut self, into: &mut Option<Saved>) -> Result<(), Fault> {
        let mut state = into.as_ref().map_or(ptr::null_mut(), |saved| saved.0);
        call!(self.fmi2GetFMUstate(&raw mut state))?;
        *into = Some(Saved(state));
        Ok(())
    }

    pub(crate) fn restore(&mut self, saved: &Saved) -> Result<(), Fault> {
        call!(self.fmi2SetFMUstate(saved.0))
    }

    pub(crate) fn forget(&mut self, Saved(mut state): Saved) -> Result<(), Fault> {
        call!(self.fmi2FreeFMUstate(&raw mut state))
    }

    /// A saved state as bytes.
    pub(crate) fn serialise(&self, saved: &Saved) -> Result<Vec<u8>, Fault> {
        let mut size = 0;
        call!(self.fmi2SerializedFMUstateSize(saved.0, &raw mut size))?;
        let mut bytes = vec![0_u8; size];
        call!(self.fmi2SerializeFMUstate(saved.0, bytes.as_mut_ptr().cast(), size))?;
        Ok(bytes)
    }

    /// A saved state from bytes.
    pub(crate) fn deserialise(&self, bytes: &[u8]) -> Result<Saved, Fault> {
        let mut state = ptr::null_mut();
        call!(self.fmi2DeSerializeFMUstate(bytes.as_ptr().cast(), bytes.len(), &raw mut state))?;
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
        call!(self.fmi2GetDirectionalDerivative(
            unknowns.as_ptr(),
            unknowns.len(),
            knowns.as_ptr(),
            knowns.len(),
            seed.as_ptr(),
            out.as_mut_ptr(),
        ))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let (Ok(free), false) = (&self.library.fmi2FreeInstance, self.lost.get()) {
            // SAFETY: the instance is live and not used after this; callbacks, log and library are dropped after it.
            unsafe { free(self.pointer) }
        }
    }
}
