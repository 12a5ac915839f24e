//! The model trait and the system trait.

use mechanics::Scalar;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{Documentation, EvaluationError, ParameterError, Spectrum, Variables};

/// A sensible run of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Experiment {
    /// Stop time of a run from 0 [s]
    pub stop: f64,
    /// Communication step [s]
    pub step: f64,
}

/// What `solver.method = auto` has to know at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// An implicit method is cheaper
    pub stiff: bool,
    /// Time after which to ask again [s]
    pub span: f64,
}

/// The first states follow `y' = A y + b + c sin(omega t + phase)`, with `A` constant as long as inertias at the ports are
/// and `b` linear in the inputs; the other states are integrals of these.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear<const N: usize> {
    /// Number of these states
    pub states: usize,
    /// c
    pub amplitude: [f64; N],
    /// omega [rad/s]
    pub omega: f64,
    /// Phase at t = 0 [rad]
    pub phase: f64,
}

/// Output variables that are computed together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// Positions, velocities, states
    Motion,
    /// F0 and M of follower ports
    Inertia,
    /// Accelerations and forces
    Dynamics,
    /// Energies
    Energy,
}

impl Group {
    /// All groups, in the order of the variable table.
    pub const ALL: [Self; 4] = [Self::Motion, Self::Inertia, Self::Dynamics, Self::Energy];
}

/// A physical system: its parameters, variables and, inside, one [`System`] for each structure it
/// can take (a joint kind, plane or space).
pub trait Model: Clone + Sized + 'static {
    /// Name of the model, an identifier
    const NAME: &'static str;
    /// One sentence
    const DESCRIPTION: &'static str;
    /// A sensible run
    const EXPERIMENT: Experiment;
    /// Write-up, icon and reference run
    const DOCUMENTATION: Documentation;
    /// Offered for Model Exchange too: the variables marked `state` are its continuous states
    const MODEL_EXCHANGE: bool = true;
    /// Inputs may follow polynomials inside a step (`port.*`); false: always held
    const PORT_TREATMENT: bool = true;
    /// Numbers of `solver.method` on offer
    const METHODS: &'static [i64] = &[1, 2, 3, 4, 5, 6];
    /// Its start value
    const METHOD: i64 = 2;
    /// Start value of `solver.step` [s]
    const STEP: f64 = 1e-3;
    /// Start values of `solver.rtol` and `solver.atol`
    const TOLERANCES: [f64; 2] = [1e-6, 1e-9];
    /// Names of the event indicators; a system with fewer uses the first ones
    const INDICATORS: &'static [&'static str] = &[];
    /// Constants of a run
    type Parameters: Variables<f64>;
    /// Inputs
    type Inputs<S: Scalar>: Variables<S>;
    /// Positions, velocities, states
    type Motion<S: Scalar>: Variables<S>;
    /// F0 and M of follower ports
    type Inertia<S: Scalar>: Variables<S>;
    /// Accelerations and forces
    type Dynamics<S: Scalar>: Variables<S>;
    /// Energies
    type Energy<S: Scalar>: Variables<S>;
    /// Discrete states, changed by [`System::update`] only
    type Discrete: Copy + Default + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned;

    /// Check the parameters and prepare all constants: the same arguments give the same model to the bit,
    /// so that a serialised state holds these instead of the model; `start`: start values of the motion group,
    /// which hold constants such as a fixed azimuth.
    ///
    /// # Errors
    /// [`ParameterError`] for values that do not fit together.
    fn new(parameters: &Self::Parameters, start: &Self::Motion<f64>) -> Result<Self, ParameterError>;

    /// Take over changed tunable parameters; nothing else may change, nor does it matter which ones came before.
    fn retune(&mut self, parameters: &Self::Parameters);

    /// What differs when a host integrates the states (no projection after steps).
    fn for_model_exchange(&mut self) {}

    /// Cases that are allowed but probably not meant, as log messages.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// What an event or a step has met that is allowed but probably not meant, as a log message; from the discrete states
    /// before and after it.
    fn notice(_before: &Self::Discrete, _after: &Self::Discrete) -> Option<String> {
        None
    }

    /// Run a job on the system that the parameters have chosen.
    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output;
}

/// A job that needs the system's number of states at the type level.
pub trait Visitor<M: Model> {
    /// What the job gives
    type Output;
    /// Do the job.
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) -> Self::Output;
}

/// The equations: pure functions of time, states `x`, inputs `u` and discrete states `d`.
///
/// `N` counts the states (energy integrals included), `Z` the event indicators.
pub trait System<const N: usize, const Z: usize> {
    /// The model that these equations belong to
    type Model: Model;
    /// Eigenvalue solver for the state Jacobian
    type Spectrum: Spectrum<N>;

    /// Consistent states at `t`, from the start values of the motion variables.
    ///
    /// # Errors
    /// [`ParameterError`] if no consistent start exists.
    fn start(
        &self,
        t: f64,
        given: &<Self::Model as Model>::Motion<f64>,
    ) -> Result<([f64; N], <Self::Model as Model>::Discrete), ParameterError>;

    /// Discrete states at the end of initialisation, when the inputs are known; until then again with
    /// every change of an input.
    fn begin(
        &self,
        _x: &[f64; N],
        _u: &<Self::Model as Model>::Inputs<f64>,
        d: &<Self::Model as Model>::Discrete,
    ) -> <Self::Model as Model>::Discrete {
        *d
    }

    /// Discrete states at the start of a communication step under its inputs; may change `x`, e.g. bring a coordinate
    /// onto the stop at which it rests.
    fn settle(
        &self,
        _x: &mut [f64; N],
        _u: &<Self::Model as Model>::Inputs<f64>,
        d: &<Self::Model as Model>::Discrete,
    ) -> <Self::Model as Model>::Discrete {
        *d
    }

    /// Time derivative of the states.
    ///
    /// # Errors
    /// [`EvaluationError`] where the equations have no value; the same for the other functions.
    fn rates<S: Scalar>(
        &self,
        t: S,
        x: &[S; N],
        u: &<Self::Model as Model>::Inputs<S>,
        d: &<Self::Model as Model>::Discrete,
    ) -> Result<[S; N], EvaluationError>;

    /// Positions, velocities, states.
    ///
    /// # Errors
    /// See [`System::rates`].
    fn motion<S: Scalar>(
        &self,
        t: S,
        x: &[S; N],
        u: &<Self::Model as Model>::Inputs<S>,
        d: &<Self::Model as Model>::Discrete,
    ) -> Result<<Self::Model as Model>::Motion<S>, EvaluationError>;

    /// F0 and M of follower ports; never reads an acceleration input.
    ///
    /// # Errors
    /// See [`System::rates`].
    fn inertia<S: Scalar>(
        &self,
        t: S,
        x: &[S; N],
        u: &<Self::Model as Model>::Inputs<S>,
        d: &<Self::Model as Model>::Discrete,
    ) -> Result<<Self::Model as Model>::Inertia<S>, EvaluationError>;

    /// Accelerations and forces.
    ///
    /// # Errors
    /// See [`System::rates`].
    fn dynamics<S: Scalar>(
        &self,
        t: S,
        x: &[S; N],
        u: &<Self::Model as Model>::Inputs<S>,
        d: &<Self::Model as Model>::Discrete,
    ) -> Result<<Self::Model as Model>::Dynamics<S>, EvaluationError>;

    /// Energies.
    ///
    /// # Errors
    /// See [`System::rates`].
    fn energy<S: Scalar>(
        &self,
        t: S,
        x: &[S; N],
        u: &<Self::Model as Model>::Inputs<S>,
        d: &<Self::Model as Model>::Discrete,
    ) -> Result<<Self::Model as Model>::Energy<S>, EvaluationError>;

    /// Names of the states: variables marked `state` in the motion and the energy group.
    fn state_names(&self) -> [String; N];

    /// Typical magnitude of each state for error control; infinite: does not count.
    fn nominals(&self) -> [f64; N] {
        [1.0; N]
    }

    /// Bring the states back on their manifold after a step; true if they changed.
    ///
    /// # Errors
    /// See [`System::rates`].
    fn project(&self, _t: f64, _x: &mut [f64; N]) -> Result<bool, EvaluationError> {
        Ok(false)
    }

    /// Which kind of method `solver.method = auto` takes now.
    fn pace(
        &self,
        _t: f64,
        _x: &[f64; N],
        _u: &<Self::Model as Model>::Inputs<f64>,
        _d: &<Self::Model as Model>::Discrete,
    ) -> Pace {
        Pace { stiff: false, span: f64::INFINITY }
    }

    /// How long a step of an adaptive method may be now [s], for rates with kinks that its error estimate may not see.
    fn longest_step(
        &self,
        _x: &[f64; N],
        _u: &<Self::Model as Model>::Inputs<f64>,
        _d: &<Self::Model as Model>::Discrete,
    ) -> f64 {
        f64::INFINITY
    }

    /// How the equations are linear now, for `solver.method = exact`; otherwise another method takes the step.
    fn linear(
        &self,
        _u: &<Self::Model as Model>::Inputs<f64>,
        _d: &<Self::Model as Model>::Discrete,
    ) -> Option<Linear<N>> {
        None
    }

    /// How far orientations are off their manifold (unit quaternions, unit vectors).
    fn off_manifold(&self, _x: &[f64; N]) -> f64 {
        0.0
    }

    /// Bring orientations back on their manifold; true if they changed.
    fn normalise(&self, _x: &mut [f64; N]) -> bool {
        false
    }

    /// Functions whose sign changes are events.
    fn indicators(
        &self,
        _t: f64,
        _x: &[f64; N],
        _u: &<Self::Model as Model>::Inputs<f64>,
        _d: &<Self::Model as Model>::Discrete,
    ) -> [f64; Z] {
        [1.0; Z]
    }

    /// The next time at which [`System::update`] has to be called, if known.
    fn next_event(&self, _d: &<Self::Model as Model>::Discrete) -> Option<f64> {
        None
    }

    /// The time events are samples with this period [s]: they read inputs that the host passes on at communication points.
    ///
    /// A sample at the end of a step therefore waits for Event Mode or, without, for the next step, when the inputs of its
    /// time are known; and a host's time may miss it by a millionth of the period, since hosts add steps up.
    fn sample_period(&self) -> Option<f64> {
        None
    }

    /// Discrete states at `t` where no event is due but inputs may have changed: in a further pass of the event iteration
    /// (others have answered to what the last one put out) and, without Event Mode, at the start of a step; may change `x`.
    fn revise(
        &self,
        _t: f64,
        _x: &mut [f64; N],
        _u: &<Self::Model as Model>::Inputs<f64>,
        d: &<Self::Model as Model>::Discrete,
    ) -> <Self::Model as Model>::Discrete {
        *d
    }

    /// True if outputs have changed to which others may answer at this very time by inputs that the event reads: then the
    /// event iteration goes on with [`System::revise`].
    fn awaits_answer(
        &self,
        _before: &<Self::Model as Model>::Discrete,
        _after: &<Self::Model as Model>::Discrete,
    ) -> bool {
        false
    }

    /// Discrete states after the event at `t`; may change `x`.
    fn update(
        &self,
        _t: f64,
        _x: &mut [f64; N],
        _u: &<Self::Model as Model>::Inputs<f64>,
        d: &<Self::Model as Model>::Discrete,
    ) -> <Self::Model as Model>::Discrete {
        *d
    }
}

/// One group of outputs into a flat slice: the single way by which values leave a system.
pub trait Outputs<const N: usize, const Z: usize>: System<N, Z> {
    /// Evaluate `group` and write its values in table order.
    ///
    /// # Errors
    /// [`EvaluationError`] where the equations have no value.
    fn evaluate<S: Scalar>(
        &self,
        group: Group,
        t: S,
        x: &[S; N],
        u: &<Self::Model as Model>::Inputs<S>,
        d: &<Self::Model as Model>::Discrete,
        values: &mut [S],
    ) -> Result<(), EvaluationError> {
        match group {
            Group::Motion => self.motion(t, x, u, d)?.store(values),
            Group::Inertia => self.inertia(t, x, u, d)?.store(values),
            Group::Dynamics => self.dynamics(t, x, u, d)?.store(values),
            Group::Energy => self.energy(t, x, u, d)?.store(values),
        }
        Ok(())
    }
}

impl<const N: usize, const Z: usize, Y: System<N, Z>> Outputs<N, Z> for Y {}
