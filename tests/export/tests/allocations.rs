//! Set, Get, doStep and derivatives allocate nothing, counted by the allocator itself.

#![allow(unsafe_code, reason = "a counting allocator")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use export_tests::Named;
use fmu_export::Interface::{CoSimulationWithEvents, ModelExchange};
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
        for method in [1.0, 2.0, 3.0] {
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
