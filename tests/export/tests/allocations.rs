//! Set, Get, doStep and derivatives allocate nothing, counted by the allocator itself.

#![allow(unsafe_code, reason = "a counting allocator, calls of exported functions")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ffi::CString;
use std::ptr::null;

use export_tests::Named;
use export_tests::rod::Rod;
use fmu_export::Interface::{CoSimulationWithEvents, ModelExchange};
use fmu_export::{Instance, Status};
use models::suspension::DoubleWishbone;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: hands everything to the system's allocator; counting touches a thread-local Cell only.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        // SAFETY: same contract.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: same contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn steps_values_and_derivatives_do_not_allocate() {
    for settings in [
        &[][..],
        &[("scene.motion", 2.0), ("use.tie", 1.0)],
        &[("closure.kind", 2.0), ("closure.k", 1e5), ("closure.c", 100.0)],
    ] {
        for method in [1.0, 2.0, 3.0, 4.0, 5.0, 6.0] {
            let mut fmu = Named::<DoubleWishbone>::default();
            for (name, value) in settings {
                fmu.set(name, *value).expect("setting");
            }
            fmu.set("solver.method", method).expect("method");
            fmu.initialize().expect("start");
            let reads =
                ["P.r.x", "P.a.z", "A.F.x", "energy.kinetic", "loop.condition"].map(|n| fmu.reference(n));
            let (force, damping) = (fmu.reference("P.F.z"), fmu.reference("strut.c"));
            let mut values = [0.0; 5];
            let before = COUNT.with(Cell::get);
            for i in 0..10_u32 {
                let t = fmu.instance.time();
                fmu.instance.set(&[force], "Float64", |_| true, |_| f64::from(i)).expect("input");
                fmu.instance
                    .set(&[damping], "Float64", |_| true, |_| 1000.0 + f64::from(i))
                    .expect("tunable");
                fmu.instance.do_step(t, 0.01).expect("step");
                fmu.instance.get_float64(&reads, &mut values).expect("outputs");
                fmu.instance
                    .directional_derivative(&reads, &[force], &[1.0], &mut values)
                    .expect("derivative");
            }
            let allocated = COUNT.with(Cell::get) - before;
            assert_eq!(allocated, 0, "{settings:?}, method {method}");
        }
    }
}

/// Moving inputs of every treatment, with the sweeps of Event Mode in between; restoring a saved state
/// takes its own room only.
#[test]
fn event_mode_and_moving_inputs_do_not_allocate() {
    for (treatment, order) in [(1.0, 0.0), (2.0, 2.0), (3.0, 3.0)] {
        let mut fmu = Named::<DoubleWishbone>::with_interface(CoSimulationWithEvents);
        fmu.set("port.inputs", treatment).expect("treatment");
        fmu.set("port.order", order).expect("order");
        fmu.initialize().expect("start");
        fmu.pass_event_mode(CoSimulationWithEvents).expect("Step Mode");
        let reads = ["P.r.x", "P.a.z", "der(lower.angle_rate.theta)"].map(|n| fmu.reference(n));
        let (force, reset) = (fmu.reference("P.F.z"), fmu.reference("port.reset"));
        let state = fmu.reference("lower.angle.theta");
        let mut values = [0.0; 3];
        let before = COUNT.with(Cell::get);
        for i in 0..10_u32 {
            fmu.instance.enter_event_mode().expect("Event Mode");
            let value = f64::from(i * i % 7);
            fmu.instance.set(&[force], "Float64", |_| true, |_| value).expect("input");
            fmu.instance.set(&[reset], "Float64", |_| true, |_| f64::from(i / 5)).expect("reset");
            fmu.instance.get_float64(&reads, &mut values).expect("outputs");
            fmu.instance
                .directional_derivative(&reads, &[force, state], &[1.0, 0.5], &mut values)
                .expect("derivative");
            fmu.pass_event_mode(CoSimulationWithEvents).expect("Step Mode");
            fmu.instance.set(&[force], "Float64", |_| true, |_| value + 1.0).expect("input");
            fmu.step(0.01).expect("step");
            fmu.instance.get_float64(&reads, &mut values).expect("outputs");
        }
        let allocated = COUNT.with(Cell::get) - before;
        assert_eq!(allocated, 0, "treatment {treatment}, order {order}");
    }
}

#[test]
fn model_exchange_does_not_allocate() {
    for settings in [&[][..], &[("scene.motion", 2.0), ("use.tie", 1.0)]] {
        let mut fmu = Named::<DoubleWishbone>::with_interface(ModelExchange);
        for (name, value) in settings {
            fmu.set(name, *value).expect("setting");
        }
        fmu.initialize().expect("start");
        fmu.pass_event_mode(ModelExchange).expect("Continuous-Time Mode");
        let n = fmu.instance.state_count();
        let (mut x, mut x_dot, mut nominals) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        fmu.instance.get_continuous_states(&mut x).expect("states");
        let force = fmu.reference("P.F.z");
        let (rate, state) =
            (fmu.reference("der(lower.angle_rate.theta)"), fmu.reference("upper.angle.theta"));
        let before = COUNT.with(Cell::get);
        for i in 0..10_u32 {
            let t = f64::from(i) * 1e-3;
            fmu.instance.set_time(t).expect("time");
            fmu.instance.set(&[force], "Float64", |_| true, |_| 10.0 * t).expect("input");
            fmu.instance.set_continuous_states(&x).expect("states");
            fmu.instance.get_derivatives(&mut x_dot).expect("derivatives");
            fmu.instance.get_nominals(&mut nominals).expect("nominals");
            fmu.instance.get_indicators(&mut []).expect("indicators");
            fmu.instance.directional_derivative(&[rate], &[state], &[1.0], &mut [0.0]).expect("derivative");
            for (x, x_dot) in x.iter_mut().zip(&x_dot) {
                *x += 1e-3 * x_dot;
            }
            if fmu.instance.completed_integrator_step().expect("done") || i == 5 {
                fmu.instance.enter_event_mode().expect("Event Mode");
                fmu.pass_event_mode(ModelExchange).expect("update");
            }
            fmu.instance.get_continuous_states(&mut x).expect("states");
        }
        assert_eq!(COUNT.with(Cell::get) - before, 0, "{settings:?}");
    }
}

fmu_export::export!(export_tests::rod::Rod);

/// The same down to the functions of FMI 2.0, which share all but their signatures with those of FMI 3.0.
#[test]
fn functions_of_fmi2_do_not_allocate() {
    use fmi2_functions::*;
    use fmi2_lifecycle::*;

    let names = Named::<Rod>::default();
    let (inputs, outputs) =
        (["A.s", "A.v"].map(|n| names.reference(n)), ["A.F", "w"].map(|n| names.reference(n)));
    let (spring, steps) = ([names.reference("spring.c")], [names.reference("solver.steps")]);
    let guid = CString::new(Instance::<Rod>::token()).expect("no zero inside");
    let (mut values, mut count) = ([0.0; 2], 0);
    // SAFETY: every pointer is null where the standard allows it, or points to as many values as said.
    unsafe {
        let rod = fmi2Instantiate(c"rod".as_ptr(), 1, guid.as_ptr(), null(), null(), 0, 0);
        assert!(!rod.is_null());
        let mut start = vec![fmi2SetupExperiment(rod, 0, 0.0, 0.0, 0, 0.0), fmi2EnterInitializationMode(rod)];
        start.push(fmi2ExitInitializationMode(rod));
        assert_eq!(start, [Status::Ok; 3]);
        let before = COUNT.with(Cell::get);
        for i in 0..10_u32 {
            let t = 0.1 * f64::from(i);
            let all = [
                fmi2SetReal(rod, inputs.as_ptr(), 2, [t.sin(), t.cos()].as_ptr()),
                fmi2SetReal(rod, spring.as_ptr(), 1, [3.0 + t].as_ptr()),
                fmi2DoStep(rod, t, 0.1, 1),
                fmi2GetReal(rod, outputs.as_ptr(), 2, values.as_mut_ptr()),
                fmi2GetInteger(rod, steps.as_ptr(), 1, &raw mut count),
                fmi2GetDirectionalDerivative(
                    rod,
                    outputs.as_ptr(),
                    1,
                    inputs.as_ptr(),
                    1,
                    [1.0].as_ptr(),
                    values.as_mut_ptr(),
                ),
            ];
            assert_eq!(all, [Status::Ok; 6]);
        }
        assert_eq!(COUNT.with(Cell::get) - before, 0);
        assert!(count >= 10);
        fmi2FreeInstance(rod);
    }
}
