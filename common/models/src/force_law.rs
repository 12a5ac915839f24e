//! A force that is a law of time: the internal load of a model, and the FMU `load`.
//!
//! ```text
//! F_i = offset_i + amplitude_i sin(omega_i t + phase_i)
//!       + pulse.amplitude_i sin(pi (t - start)/duration)   inside [start, start + duration]
//! ```

use std::f64::consts::PI;

use mechanics::{Dim, Scalar, Space, Vector};
use model::{Variables, Vector3};
use serde::{Deserialize, Serialize};

/// Parameters of a load.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct LoadParameters {
    /// Constant part of the load [N]
    #[var(name = "offset", start = 0.0)]
    pub offset: Vector3<f64>,
    /// Amplitude of the load [N]
    #[var(name = "amplitude", start = [0.0, 0.0, 10.0])]
    pub amplitude: Vector3<f64>,
    /// Angular frequency of the load [rad/s]
    #[var(name = "omega", start = [10.0, 10.0, 10.0])]
    pub omega: Vector3<f64>,
    /// Phase of the load [rad]
    #[var(name = "phase", start = 0.0)]
    pub phase: Vector3<f64>,
    /// Amplitude of the half-sine pulse of the load [N]
    #[var(name = "pulse.amplitude", start = 0.0)]
    pub pulse_amplitude: Vector3<f64>,
    /// Start of the pulse [s]
    #[var(name = "pulse.start", start = 0.0)]
    pub pulse_start: f64,
    /// Duration of the pulse; 0: none [s]
    #[var(name = "pulse.duration", start = 0.0, min = 0.0)]
    pub pulse_duration: f64,
}

/// Where the time stands relative to the pulse; changed by the time events at both ends.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum PulsePhase {
    /// Not yet begun
    #[default]
    Before,
    /// Inside
    During,
    /// Over, or no pulse at all
    After,
}

/// The load law in the space of dimension `D`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LoadLaw<const D: usize> {
    offset: Vector<f64, D>,
    amplitude: Vector<f64, D>,
    omega: Vector<f64, D>,
    phase: Vector<f64, D>,
    pulse_amplitude: Vector<f64, D>,
    pulse_start: f64,
    pulse_duration: f64,
}

impl<const D: usize> LoadLaw<D>
where
    Dim<D>: Space<D>,
{
    pub(crate) fn new(p: &LoadParameters) -> Self {
        let part = |v| Dim::<D>::restrict(&v);
        Self {
            offset: part(p.offset),
            amplitude: part(p.amplitude),
            omega: part(p.omega),
            phase: part(p.phase),
            pulse_amplitude: part(p.pulse_amplitude),
            pulse_start: p.pulse_start,
            pulse_duration: p.pulse_duration,
        }
    }

    /// Force at P [N].
    #[inline]
    pub(crate) fn force<S: Scalar>(&self, t: S, phase: PulsePhase) -> Vector<S, D> {
        let mut F = self.offset.map(S::lift);
        for i in 0..D {
            if !self.amplitude[i].vanishes() {
                F[i] += (t * self.omega[i] + self.phase[i]).sin() * self.amplitude[i];
            }
        }
        if phase == PulsePhase::During {
            let shape = ((t - self.pulse_start) * (PI / self.pulse_duration)).sin();
            F += self.pulse_amplitude.map(|a| shape * a);
        }
        F
    }

    /// Time of the next kink [s].
    pub(crate) fn next_event(&self, phase: PulsePhase) -> Option<f64> {
        match phase {
            PulsePhase::Before => Some(self.pulse_start),
            PulsePhase::During => Some(self.pulse_start + self.pulse_duration),
            PulsePhase::After => None,
        }
    }

    /// Phase from `t` on; a pulse of zero duration or zero amplitude never begins.
    pub(crate) fn phase(&self, t: f64) -> PulsePhase {
        let nothing = self.pulse_duration <= 0.0 || self.pulse_amplitude.iter().all(|a| a.vanishes());
        if nothing || t >= self.pulse_start + self.pulse_duration {
            PulsePhase::After
        } else if t >= self.pulse_start {
            PulsePhase::During
        } else {
            PulsePhase::Before
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(duration: f64) -> LoadLaw<2> {
        let mut p = LoadParameters::default();
        p.amplitude.z = 0.0;
        p.pulse_amplitude.z = 800.0;
        p.pulse_start = 0.5;
        p.pulse_duration = duration;
        LoadLaw::new(&p)
    }

    /// Half-sine: zero at both ends, the amplitude in the middle; the events lead through it.
    #[test]
    fn pulse_is_a_half_sine_between_its_events() {
        let law = law(0.08);
        let mut phase = law.phase(0.0);
        assert_eq!(law.next_event(phase), Some(0.5));
        phase = law.phase(0.5);
        assert!(law.force(0.5, phase).y.abs() < 1e-12);
        assert!((law.force(0.54, phase).y - 800.0).abs() < 1e-9);
        phase = law.phase(law.next_event(phase).expect("the pulse ends"));
        assert_eq!((phase, law.next_event(phase)), (PulsePhase::After, None));
        assert!(law.force(0.6, phase).y.vanishes());
    }

    #[test]
    fn zero_duration_means_no_pulse() {
        assert_eq!(law(0.0).phase(0.0), PulsePhase::After);
    }
}
