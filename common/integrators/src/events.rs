//! Zero crossings of indicators, located to the resolution of time.
//!
//! Each step is looked at in four quarters on the dense output; while an indicator has no side, in powers of two
//! from `2^-20` of the step on. A crossing is bracketed on the dense output first, then on the method itself: the
//! step is repeated with the length `theta h` until its own end crosses zero. So the state at the event is a step of
//! the method, with its full order.

use crate::root::bracket;
use crate::run::{Stop, Watch};
use crate::{Dense, StepError};

/// Functions of time and state whose zero crossings are events.
///
/// What counts, for an indicator `g`:
/// 1. At the start of a call `g` is on a side, above or below zero, or within its [band](Self::band) around zero.
///    In the band it has no side yet: it takes the first side on which it is seen outside the band, and this is no
///    event. An indicator that starts at zero counts only when it has left and comes back.
/// 2. `g` beyond zero, on the other side, is an event. Touching zero is none.
/// 3. When a call returns, at its end or at an event, every indicator that had a side and now is beyond zero *or within
///    its band* is reported. So nothing is lost that the next call would take for a start at zero (1), simultaneous
///    events come together, and none comes twice.
///
/// The state at an event lies just beyond the crossing, by at most `4 eps max(|t|, h)` in time. Two crossings of one
/// indicator within a quarter of a step can go unseen.
pub trait Indicators<const N: usize, const M: usize> {
    /// The indicators; continuous in `t` and `x`.
    fn indicators(&self, t: f64, x: &[f64; N]) -> [f64; M];

    /// How near to zero counts as zero at the start and end of a call.
    ///
    /// Above what the resolution of time, `4 eps |t|`, makes of the indicator's rate, else an event whose map
    /// turns the motion around comes twice; below the accuracy wanted for events at the end of a call.
    fn band(&self) -> [f64; M] {
        [1e-10; M]
    }
}

/// What an indicator did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Crossing {
    /// It did not cross zero.
    #[default]
    None,
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
}

/// How far a call came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reached<const M: usize> {
    /// The end asked for.
    End,
    /// The first event; the state is the one just after it.
    Event {
        /// Time of the event [s]
        t: f64,
        /// What each indicator did.
        which: [Crossing; M],
    },
}

/// Fractions of a step at which the indicators are looked at.
const QUARTERS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// First look at an indicator without a side: `2^-20` of the step.
const FIRST_LOOK: i32 = -20;
/// Width of the final bracket in units of the rounding of time.
const RESOLUTION: f64 = 4.0 * f64::EPSILON;

/// Which side of zero; `None` within the band at the start.
type Side = Option<f64>;

/// Watches indicators over one call.
pub(crate) struct Monitor<'a, E, const M: usize> {
    events: &'a E,
    band: [f64; M],
    sides: [Side; M],
    started: bool,
    /// Set when the run was stopped.
    pub(crate) which: Option<[Crossing; M]>,
}

impl<'a, E, const M: usize> Monitor<'a, E, M> {
    pub(crate) fn new<const N: usize>(events: &'a E) -> Self
    where
        E: Indicators<N, M>,
    {
        Self { events, band: events.band(), sides: [None; M], started: false, which: None }
    }

    fn values<const N: usize, F>(&self, t: f64, x: &[f64; N]) -> Result<[f64; M], StepError<F>>
    where
        E: Indicators<N, M>,
    {
        let g = self.events.indicators(t, x);
        match g.iter().position(|v| !v.is_finite()) {
            Some(index) => Err(StepError::IndicatorNotFinite { t, index, value: g[index] }),
            None => Ok(g),
        }
    }

    /// Distance to the first crossing: the smallest indicator, each positive on its own side; negative after a
    /// crossing.
    fn margin(&self, g: &[f64; M]) -> f64 {
        self.sides
            .iter()
            .zip(g)
            .filter_map(|(side, g)| side.map(|side| side * g))
            .fold(f64::INFINITY, f64::min)
    }

    /// Gives a side to the indicators that have left their band.
    fn take_sides(&mut self, g: &[f64; M]) {
        for ((side, g), band) in self.sides.iter_mut().zip(g).zip(self.band) {
            if side.is_none() && g.abs() > band {
                *side = Some(g.signum());
            }
        }
    }

    /// What has crossed or arrived (rule 3).
    fn crossings(&self, g: &[f64; M]) -> [Crossing; M] {
        std::array::from_fn(|i| match self.sides[i] {
            Some(side) if side * g[i] <= self.band[i] => {
                if side > 0.0 {
                    Crossing::Falling
                } else {
                    Crossing::Rising
                }
            }
            _ => Crossing::None,
        })
    }

    fn stop<const N: usize>(&mut self, theta: f64, x: [f64; N], g: &[f64; M]) -> Stop<N> {
        self.which = Some(self.crossings(g));
        Stop { theta, x }
    }

    /// The crossing inside `[lo, hi]`, fractions of the step with the margins `at_ends`.
    fn locate<const N: usize, F>(
        &mut self,
        step: &Dense<N>,
        ends: [f64; 2],
        at_ends: [f64; 2],
        mut restep: impl FnMut(f64) -> Result<[f64; N], StepError<F>>,
    ) -> Result<Stop<N>, StepError<F>>
    where
        E: Indicators<N, M>,
    {
        let time = |theta: f64| step.t + theta * step.h;
        let width = RESOLUTION * (step.t.abs() / step.h).max(1.0);
        let on_dense = |theta| Ok(self.margin(&self.values(time(theta), &step.at(theta))?));
        let [_, guess] = bracket(on_dense, ends, at_ends, width)?;

        let mut on_step = |theta| Ok(self.margin(&self.values(time(theta), &restep(theta)?)?));
        let slope = (at_ends[0] - at_ends[1]) / (ends[1] - ends[0]);
        let found = match surround(&mut on_step, guess, ends, width, slope)? {
            Some((around, margins)) => Some(bracket(&mut on_step, around, margins, width)?[1]),
            None => None,
        };
        let (theta, x) = match found {
            Some(theta) => (theta, restep(theta)?),
            None => (guess, step.at(guess)), // the two disagree about the crossing: dense output decides
        };
        let g = self.values(time(theta), &x)?;
        Ok(self.stop(theta, x, &g))
    }
}

/// Goes out from `guess` until `f(a) >= 0 > f(b)`, not beyond `limits`.
#[allow(clippy::type_complexity, reason = "a bracket and the values at its ends")]
fn surround<F>(
    mut f: impl FnMut(f64) -> Result<f64, F>,
    guess: f64,
    limits: [f64; 2],
    width: f64,
    slope: f64,
) -> Result<Option<([f64; 2], [f64; 2])>, F> {
    let mut inner = (guess, f(guess)?);
    let backward = inner.1 < 0.0;
    let mut reach = (2.0 * inner.1.abs() / slope).max(width);
    loop {
        let theta = if backward { (guess - reach).max(limits[0]) } else { (guess + reach).min(limits[1]) };
        let value = f(theta)?;
        if (value < 0.0) != backward {
            return Ok(Some(if backward {
                ([theta, inner.0], [value, inner.1])
            } else {
                ([inner.0, theta], [inner.1, value])
            }));
        }
        if theta <= limits[0] || theta >= limits[1] {
            return Ok(None);
        }
        inner = (theta, value);
        reach *= 4.0;
    }
}

impl<const N: usize, const M: usize, E: Indicators<N, M>> Watch<N> for Monitor<'_, E, M> {
    const WATCHES: bool = true;

    fn inspect<F>(
        &mut self,
        step: &Dense<N>,
        last: bool,
        restep: impl FnMut(f64) -> Result<[f64; N], StepError<F>>,
    ) -> Result<Option<Stop<N>>, StepError<F>> {
        let x = step.at(0.0);
        let g = self.values(step.t, &x)?;
        self.take_sides(&g);
        if self.started && self.margin(&g) < 0.0 {
            return Ok(Some(self.stop(0.0, x, &g))); // a projection moved the state over the edge
        }
        self.started = true;
        let mut before = (0.0, self.margin(&g));
        let mut theta = if self.sides.contains(&None) { f64::from(FIRST_LOOK).exp2() } else { QUARTERS[0] };
        loop {
            let x = step.at(theta);
            let g = self.values(step.t + theta * step.h, &x)?;
            self.take_sides(&g);
            let margin = self.margin(&g);
            if margin < 0.0 {
                return self.locate(step, [before.0, theta], [before.1, margin], restep).map(Some);
            }
            if theta >= 1.0 {
                let arrived = last && self.crossings(&g).iter().any(|c| *c != Crossing::None);
                return Ok(arrived.then(|| self.stop(1.0, x, &g)));
            }
            before = (theta, margin);
            theta = if theta < QUARTERS[0] { 2.0 * theta } else { theta + QUARTERS[0] };
        }
    }
}
