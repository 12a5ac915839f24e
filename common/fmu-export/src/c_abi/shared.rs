//! Functions that FMI 2.0 and 3.0 have in common, with the rule of the one or the other.

use std::ffi::{c_char, c_void};

use model::Kind;

use super::{array, array_mut, call, put, text};
use crate::phase::Rule;
use crate::{Exported, Fault, SerialisedStateError, Status};

/// Functions that hand their arguments to a shared one with their own rule.
macro_rules! forward {
    ($($name:ident($($arg:ident: $type:ty),*) $rule:ident $body:ident;)*) => {
        $(
            #[doc(hidden)]
            pub unsafe fn $name<I: Exported>(instance: *mut c_void, $($arg: $type),*) -> Status {
                // SAFETY: the arguments as the host passes them.
                unsafe { $crate::c_abi::shared::$body::<I>(instance, &phase::$rule, $($arg),*) }
            }
        )*
    };
}

/// Functions that are one method of the instance, without arguments or with one value.
macro_rules! methods {
    ($($name:ident($($arg:ident: $type:ty)?) $rule:ident $method:ident;)*) => {
        $(
            #[doc(hidden)]
            pub unsafe fn $name<I: Exported>(instance: *mut c_void, $($arg: $type)?) -> Status {
                // SAFETY: FMI instance, checked for null by `call`.
                unsafe { call::<I>(instance, &phase::$rule, |c| c.instance.$method($($arg)?)) }
            }
        )*
    };
}

/// Functions that fill one list of numbers.
macro_rules! lists {
    ($($name:ident $rule:ident $method:ident;)*) => {
        $(
            #[doc(hidden)]
            pub unsafe fn $name<I: Exported>(instance: *mut c_void, values: *mut f64, n: usize) -> Status {
                // SAFETY: FMI pointers, checked for null.
                unsafe {
                    call::<I>(instance, &phase::$rule, |c| {
                        c.instance.$method(array_mut("values", values, n)?)
                    })
                }
            }
        )*
    };
}

/// Get and Set of a type whose values are stored as whole numbers.
macro_rules! whole_numbers {
    ($get:ident $get_rule:ident $set:ident $set_rule:ident $type:ty, ($($count:ident)?), $called:literal, $is:pat, $from:expr, $to:expr) => {
        #[doc(hidden)]
        pub unsafe fn $get<I: Exported>(
            instance: *mut c_void,
            references: *const u32,
            n: usize,
            values: *mut $type,
            $($count: usize,)?
        ) -> Status {
            #[allow(unused_variables, reason = "FMI 2.0 has one number for both")]
            let n_values = n;
            $(let n_values = $count;)?
            // SAFETY: FMI pointers, checked for null.
            unsafe {
                call::<I>(instance, &phase::$get_rule, |c| {
                    let references = array("valueReferences", references, n)?;
                    let values = array_mut("values", values, n_values)?;
                    $crate::values::same_length(n, n_values)?;
                    let to: fn(f64) -> Option<$type> = $to;
                    c.instance.get_whole(references, $called, |k| matches!(k, $is), |i, v| {
                        to(v).map(|v| values[i] = v).is_some()
                    })
                })
            }
        }

        #[doc(hidden)]
        pub unsafe fn $set<I: Exported>(
            instance: *mut c_void,
            references: *const u32,
            n: usize,
            values: *const $type,
            $($count: usize,)?
        ) -> Status {
            #[allow(unused_variables, reason = "FMI 2.0 has one number for both")]
            let n_values = n;
            $(let n_values = $count;)?
            // SAFETY: FMI pointers, checked for null.
            unsafe {
                call::<I>(instance, &phase::$set_rule, |c| {
                    let references = array("valueReferences", references, n)?;
                    let values = array("values", values, n_values)?;
                    $crate::values::same_length(n, n_values)?;
                    let from: fn($type) -> f64 = $from;
                    c.instance.set(references, $called, |k| matches!(k, $is), |i| from(values[i]))
                })
            }
        }
    };
}

pub(super) use {forward, lists, methods, whole_numbers};

/// Switch log categories on or off: those named, or all.
pub(super) unsafe fn set_debug_logging<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    on: bool,
    n: usize,
    categories: *const *const c_char,
) -> Status {
    // SAFETY: FMI pointers, checked for null by `call`, `array` and `text`.
    unsafe {
        call::<I>(instance, rule, |c| {
            let names: Vec<_> = array("categories", categories, n)?.iter().map(|name| text(*name)).collect();
            c.log.choose(on, &names)
        })
    }
}

pub(super) unsafe fn exit_initialization<I: Exported>(instance: *mut c_void, rule: &Rule) -> Status {
    // SAFETY: FMI instance, checked for null by `call`; the same for the functions below.
    unsafe { call::<I>(instance, rule, |c| c.instance.exit_initialization()) }
}

pub(super) unsafe fn terminate<I: Exported>(instance: *mut c_void, rule: &Rule) -> Status {
    // SAFETY: see above.
    unsafe {
        call::<I>(instance, rule, |c| {
            c.instance.terminate();
            Ok(())
        })
    }
}

pub(super) unsafe fn reset<I: Exported>(instance: *mut c_void, rule: &Rule) -> Status {
    // SAFETY: see above.
    unsafe { call::<I>(instance, rule, |c| c.instance.reset()) }
}

pub(super) unsafe fn set_continuous_states<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    states: *const f64,
    n: usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<I>(instance, rule, |c| c.instance.set_continuous_states(array("continuousStates", states, n)?))
    }
}

pub(super) unsafe fn get_reals<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    references: *const u32,
    n: usize,
    values: *mut f64,
    n_values: usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<I>(instance, rule, |c| {
            let references = array("valueReferences", references, n)?;
            c.instance.get_float64(references, array_mut("values", values, n_values)?)
        })
    }
}

pub(super) unsafe fn set_reals<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    references: *const u32,
    n: usize,
    values: *const f64,
    n_values: usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<I>(instance, rule, |c| {
            let (references, values) =
                (array("valueReferences", references, n)?, array("values", values, n_values)?);
            crate::values::same_length(n, n_values)?;
            let called = c.instance.type_name(Kind::Float64);
            c.instance.set(references, called, |k| k == Kind::Float64, |i| values[i])
        })
    }
}

/// Get or Set of a type of which there are no variables: right for none, an error for any.
pub(super) unsafe fn no_variables<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    called: &'static str,
    (references, n): (*const u32, usize),
    n_values: usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<I>(instance, rule, |c| {
            let references = array("valueReferences", references, n)?;
            crate::values::same_length(n, n_values)?;
            c.instance.get_whole(references, called, |_| false, |_, _| true)
        })
    }
}

pub(super) unsafe fn directional_derivative<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    (unknowns, n_unknowns): (*const u32, usize),
    (knowns, n_knowns): (*const u32, usize),
    (seed, n_seed): (*const f64, usize),
    (sensitivity, n_sensitivity): (*mut f64, usize),
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<I>(instance, rule, |c| {
            let unknowns = array("unknowns", unknowns, n_unknowns)?;
            let knowns = array("knowns", knowns, n_knowns)?;
            let seed = array("seed", seed, n_seed)?;
            let sensitivity = array_mut("sensitivity", sensitivity, n_sensitivity)?;
            c.instance.directional_derivative(unknowns, knowns, seed, sensitivity)
        })
    }
}

/// A saved state.
///
/// # Safety
/// `state` is null or a state that was given out and not freed.
unsafe fn saved<'a, I: Exported>(state: *mut c_void) -> Result<&'a I::State, Fault> {
    // SAFETY: by the contract of this function.
    unsafe { state.cast::<I::State>().as_ref() }.ok_or(Fault::Null { argument: "FMUState" })
}

pub(super) unsafe fn get_state<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    state: *mut *mut c_void,
) -> Status {
    // SAFETY: FMI pointers, checked for null; a state that is not null was given out here.
    unsafe {
        call::<I>(instance, rule, |c| {
            let slot = &mut array_mut("FMUState", state, 1)?[0];
            match slot.cast::<I::State>().as_mut() {
                Some(copy) => c.instance.save_into(copy)?,
                None => *slot = Box::into_raw(c.instance.save()?).cast(),
            }
            Ok(())
        })
    }
}

pub(super) unsafe fn set_state<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    state: *mut c_void,
) -> Status {
    // SAFETY: FMI pointers, checked for null; a state that is not null was given out here.
    unsafe { call::<I>(instance, rule, |c| c.instance.restore(saved::<I>(state)?)) }
}

pub(super) unsafe fn free_state<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    state: *mut *mut c_void,
) -> Status {
    // SAFETY: a state that is not null came from `Box::into_raw` here.
    unsafe {
        call::<I>(instance, rule, |_| {
            let slot = &mut array_mut("FMUState", state, 1)?[0];
            if !slot.is_null() {
                drop(Box::from_raw(slot.cast::<I::State>()));
                *slot = std::ptr::null_mut();
            }
            Ok(())
        })
    }
}

pub(super) unsafe fn serialised_size<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    state: *mut c_void,
    size: *mut usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null; a state that is not null was given out here.
    unsafe {
        call::<I>(instance, rule, |c| put("size", size, c.instance.serialise(saved::<I>(state)?)?.len()))
    }
}

pub(super) unsafe fn serialise<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    state: *mut c_void,
    data: *mut u8,
    size: usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null; a state that is not null was given out here.
    unsafe {
        call::<I>(instance, rule, |c| {
            let bytes = c.instance.serialise(saved::<I>(state)?)?;
            if size != bytes.len() {
                return Err(SerialisedStateError::length(size, bytes.len()).into());
            }
            array_mut("serializedState", data, size)?.copy_from_slice(&bytes);
            Ok(())
        })
    }
}

pub(super) unsafe fn deserialise<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    data: *const u8,
    size: usize,
    state: *mut *mut c_void,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<I>(instance, rule, |c| {
            let slot = &mut array_mut("FMUState", state, 1)?[0];
            *slot = Box::into_raw(c.instance.deserialise(array("serializedState", data, size)?)?).cast();
            Ok(())
        })
    }
}

/// A function that this FMU does not offer.
pub(super) unsafe fn unsupported<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    function: &'static str,
    reason: &'static str,
) -> Status {
    // SAFETY: FMI instance, checked for null by `call`.
    unsafe { call::<I>(instance, &rule.named(function), |_| Err(Fault::Unsupported { reason })) }
}
