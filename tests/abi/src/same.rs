//! Types that are passed over the C boundary in the same way.

use std::ffi::c_void;

use fmi_sys::fmi2::{fmi2CallbackFunctions, fmi2EventInfo};
use fmu_export::Status;
use fmu_export::c_abi::fmi2::{CallbackFunctions, EventInfo};

/// A type here that is passed like the type `T` of the header.
pub(crate) trait Same<T> {}

macro_rules! same {
    ($($here:ty = $header:ty;)*) => {
        $(
            impl Same<$header> for $here {}
            const _: () = assert!(
                size_of::<$here>() == size_of::<$header>() && align_of::<$here>() == align_of::<$header>()
            );
        )*
    };
}
same! {
    () = ();
    c_void = c_void;
    f32 = f32;
    f64 = f64;
    i8 = i8;
    u8 = u8;
    i16 = i16;
    u16 = u16;
    i32 = i32;
    u32 = u32;
    i64 = i64;
    u64 = u64;
    usize = usize;
    u8 = bool; // any byte may come in, only 0 and 1 go out
    Status = u32; // an enum of C without negative values
    CallbackFunctions = fmi2CallbackFunctions;
    EventInfo = fmi2EventInfo;
}

impl<T: Same<S>, S> Same<*const S> for *const T {}
impl<T: Same<S>, S> Same<*mut S> for *mut T {}
impl<T: Same<S>, S> Same<Option<S>> for Option<T> {}

/// A callback that is never called.
impl<S> Same<Option<S>> for *const c_void {}

macro_rules! functions {
    ($([$($here:ident $header:ident),*];)*) => {
        $(
            impl<R: Same<S>, S, $($here: Same<$header>, $header),*> Same<unsafe extern "C" fn($($header),*) -> S>
                for unsafe extern "C" fn($($here),*) -> R
            {
            }
        )*
    };
}
functions! {
    [];
    [A1 B1];
    [A1 B1, A2 B2];
    [A1 B1, A2 B2, A3 B3];
    [A1 B1, A2 B2, A3 B3, A4 B4];
    [A1 B1, A2 B2, A3 B3, A4 B4, A5 B5];
    [A1 B1, A2 B2, A3 B3, A4 B4, A5 B5, A6 B6];
    [A1 B1, A2 B2, A3 B3, A4 B4, A5 B5, A6 B6, A7 B7];
    [A1 B1, A2 B2, A3 B3, A4 B4, A5 B5, A6 B6, A7 B7, A8 B8];
    [A1 B1, A2 B2, A3 B3, A4 B4, A5 B5, A6 B6, A7 B7, A8 B8, A9 B9];
    [A1 B1, A2 B2, A3 B3, A4 B4, A5 B5, A6 B6, A7 B7, A8 B8, A9 B9, A10 B10];
    [A1 B1, A2 B2, A3 B3, A4 B4, A5 B5, A6 B6, A7 B7, A8 B8, A9 B9, A10 B10, A11 B11, A12 B12];
}

/// The logger of FMI 2.0.
impl<A1: Same<B1>, B1, A2: Same<B2>, B2, A3: Same<B3>, B3, A4: Same<B4>, B4, A5: Same<B5>, B5>
    Same<unsafe extern "C" fn(B1, B2, B3, B4, B5, ...)> for unsafe extern "C" fn(A1, A2, A3, A4, A5, ...)
{
}

/// Fields of a structure: the same places, types that are passed in the same way.
macro_rules! fields {
    ($here:ty, $header:ty: $($field:ident $name:ident;)*) => {
        const _: () = {
            const fn same<T: Same<S>, S>(_: fn(&$here) -> &T, _: fn(&$header) -> &S) {}
            $(
                assert!(std::mem::offset_of!($here, $field) == std::mem::offset_of!($header, $name));
                same(|here| &here.$field, |header| &header.$name);
            )*
        };
    };
}
fields! { CallbackFunctions, fmi2CallbackFunctions:
    logger logger;
    allocate_memory allocateMemory;
    free_memory freeMemory;
    step_finished stepFinished;
    environment componentEnvironment;
}
fields! { EventInfo, fmi2EventInfo:
    again newDiscreteStatesNeeded;
    terminate terminateSimulation;
    nominals_changed nominalsOfContinuousStatesChanged;
    states_changed valuesOfContinuousStatesChanged;
    next_defined nextEventTimeDefined;
    next nextEventTime;
}
