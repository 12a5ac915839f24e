//! What a model is: parameters, variables in groups, and pure functions of `(t, x, u, d)`.
//!
//! A physical system implements [`Model`] (its variables and parameters) and [`System`] (its
//! equations with a fixed number of states). Output variables come in the groups of the port
//! concept, each computed only when somebody reads it:
//!
//! | group | holds | needs |
//! | --- | --- | --- |
//! | motion | r, v of ports, coordinates, rates | states |
//! | inertia | F0, M of follower ports | states, r, v, slot loads |
//! | dynamics | accelerations, forces | all inputs |
//! | energy | kinetic, potential, integrals | states |
//!
//! Nothing here knows an interface standard: the export layer reads the variable tables.

#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "port letters")]

mod documentation;
mod error;
mod jacobian;
mod leaf;
mod system;
mod variable;

pub use documentation::{Documentation, Plot};
pub use error::{EvaluationError, ParameterError};
pub use jacobian::{Dense, NoStates, Spectrum, directional, state_jacobian};
pub use leaf::{NoVariables, PlanarTensor, SymmetricTensor, Vector2, Vector3};
pub use mechanics::{Matrix, Scalar};
pub use model_derive::{Enumeration, Variables};
pub use system::{Experiment, Group, Linear, Model, Outputs, Pace, System, Visitor};
pub use variable::{
    Attributes, Causality, Entry, EnumType, Initial, Item, Kind, PortLaw, Rate, Variability, Variables,
    count_states, fill,
};

// The derives name this crate by its path, also inside it.
extern crate self as model;

#[cfg(test)]
mod tests {
    use super::*;

    /// How it moves
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
    enum Kinds {
        /// One
        FirstKind = 1,
        /// Two
        Second = 2,
    }

    #[derive(Debug, Clone, Copy, PartialEq, Variables)]
    struct Port<S> {
        /// Position [m]
        #[var(name = "r")]
        r: Vector3<S>,
    }

    #[derive(Debug, Clone, Copy, PartialEq, Variables)]
    #[variables(output)]
    struct Out<S> {
        #[var(prefix = "P.", sampled)]
        P: Port<S>,
        /// Angle of the link [rad]
        #[var(name = "angle.theta", approx, start = 0.5, nominal = 0.1)]
        theta: S,
        /// Rank
        #[var(name = "loop.rank", local)]
        rank: S,
        /// Spin [rad/s]
        #[var(name = "spin", state, depends = ["P.F"], rate_depends = [["P.F.x"], TURN, []])]
        spin: Vector3<S>,
    }

    const TURN: &[&str] = &["angle", "spin"];

    #[derive(Debug, Clone, PartialEq, Variables)]
    #[variables(parameter)]
    struct Param {
        /// Mass of the body [kg]
        ///
        /// More text.
        #[var(name = "mass", start = 4.0, above = 0.0)]
        m: f64,
        /// Kind
        #[var(name = "kind", item = Kinds::Second)]
        kind: Kinds,
        /// Point [m]
        #[var(name = "design.A", start = [1.0, 2.0, 3.0], tunable)]
        A: Vector3<f64>,
        /// Use it
        #[var(name = "use.it", start = true)]
        it: bool,
    }

    #[test]
    fn the_table_has_names_units_and_bounds() {
        let names: Vec<_> = <Out<f64> as Variables<f64>>::TABLE.iter().map(Entry::name).collect();
        assert_eq!(names[..5], ["P.r.x", "P.r.y", "P.r.z", "angle.theta", "loop.rank"]);
        let table = <Out<f64> as Variables<f64>>::TABLE;
        assert_eq!((table[0].unit, table[0].description), ("m", "Position"));
        assert_eq!(table[0].causality, Causality::Output);
        assert_eq!((table[0].port, table[3].port), (PortLaw::Sampled, PortLaw::Regular));
        assert_eq!(table[4].causality, Causality::Local);
        assert_eq!((table[3].initial, table[3].start, table[3].nominal), (Initial::Approx, 0.5, 0.1));
        let mass = <Param as Variables<f64>>::TABLE[0];
        assert_eq!((mass.min, mass.unit, mass.description), (f64::MIN_POSITIVE, "kg", "Mass of the body"));
        assert_eq!(<Param as Variables<f64>>::TABLE[3].variability, Variability::Tunable);
        let Kind::Enumeration(kinds) = <Param as Variables<f64>>::TABLE[1].kind else {
            panic!("enumeration")
        };
        assert_eq!((kinds.items[0].name, kinds.items[1].value), ("first_kind", 2));
    }

    #[test]
    fn states_know_what_belongs_to_their_derivatives() {
        let table = <Out<f64> as Variables<f64>>::TABLE;
        assert_eq!(count_states(table), 3);
        let rates: Vec<_> = table.iter().filter_map(|v| v.rate).collect();
        assert!(rates.iter().all(|r| r.unit == "rad/s2"));
        assert_eq!(rates[0].depends, ["P.F.x"]);
        assert_eq!(rates[1].depends, TURN);
        assert!(rates[2].depends.is_empty());
        assert!(table[5..].iter().all(|v| v.depends == ["P.F"]));
    }

    #[test]
    fn values_survive_store_and_load() {
        let p = Param::default();
        assert_eq!((p.m, p.kind, p.A, p.it), (4.0, Kinds::Second, Vector3::new(1.0, 2.0, 3.0), true));
        let mut values = [0.0; 6];
        p.store(&mut values);
        assert_eq!(Param::load(&values), p);
        assert_eq!(values.map(f64::to_bits), [4.0, 2.0, 1.0, 2.0, 3.0, 1.0].map(f64::to_bits));
    }
}
