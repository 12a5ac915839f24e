//! Control laws of the absorber: what makes it a Rayleigh-van-der-Pol oscillator, and the design values behind them.
//!
//! Numbers as in `rvdp_absorber.md`.

use mechanics::Scalar;
use model::{Dense, EvaluationError, Matrix, Spectrum};

/// |n eta| and gamma below which (14) has a pole.
const POLE: f64 = 1e-12;

/// Parameters of the control laws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlLaw {
    /// Mass of the absorber [kg]
    pub m: f64,
    /// Spring that the law replaces [N/m]
    pub c: f64,
    /// Damping that the law takes away [N.s/m]
    pub d: f64,
    /// Gain [s/m2]
    pub gamma: f64,
    /// Wanted amplitude, law (16) [m]
    pub X: f64,
    /// Amplitude of the design force [N]
    pub F_d: f64,
    /// Sine of the design phase, the lead of the force over x
    pub sin_alpha: f64,
    /// Cosine of the design phase
    pub cos_alpha: f64,
    /// Energy of the limit cycle, law (14) [J]
    pub H0: f64,
}

/// The synchronised motion that a law is made for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Design<S> {
    /// Amplitude relative to l^ and frequency relative to the limit cycle's, (13)
    pub n: S,
    /// The same for the frequency
    pub eta: S,
    /// Amplitude; below zero: turned by pi [m]
    pub X: S,
    /// `F_d/(m Omega^2 X)`
    pub f: S,
    /// `gamma Omega X^2`
    pub g: S,
}

/// What (14) needs: eta*, n*, l^.
struct Inverse<S> {
    n: S,
    eta: S,
    l: S,
}

impl ControlLaw {
    /// Force on the absorber mass by the direct law (16) [N].
    #[inline]
    pub fn direct<S: Scalar>(&self, omega: S, x: S, w: S) -> S {
        let Self { m, c, d, gamma, X, F_d, .. } = *self;
        let (Ox, OX) = (omega * x, omega * X);
        let resistance = (w * w + Ox * Ox - OX * OX) * (0.5 * gamma * m);
        let (f_s, f_c) = (F_d * self.sin_alpha / X, F_d * self.cos_alpha / X);
        -(resistance + S::lift(f_s) / omega - d) * w - (omega * omega * m + f_c - c) * x
    }

    /// Force on the absorber mass by the law of the paper (14) [N].
    ///
    /// # Errors
    /// At its poles, n eta = 0 and gamma = 0.
    pub fn paper<S: Scalar>(&self, omega: S, x: S, w: S) -> Result<S, EvaluationError> {
        let Self { m, c, d, gamma, H0, .. } = *self;
        let Inverse { n, eta, .. } = self.inverse(omega)?;
        let (Ox, n_eta) = (omega * x, n * eta);
        let bracket = (n + 1.0) / (n_eta * 2.0) - n_eta * n_eta;
        let resistance = ((w * w + Ox * Ox) * m + bracket * (2.0 * H0)) * (0.5 * gamma);
        let stiffness = omega * omega * (S::lift(1.0) + (eta + 1.0) / (n_eta * 2.0)) * m;
        Ok(-(resistance - d) * w - (stiffness - c) * x)
    }

    /// (13)
    fn inverse<S: Scalar>(&self, omega: S) -> Result<Inverse<S>, EvaluationError> {
        let Self { m, gamma, F_d, sin_alpha, cos_alpha, H0, .. } = *self;
        if gamma < POLE {
            let quantity = "control.gamma of the paper's law (14)";
            return Err(EvaluationError::Vanishes { quantity, value: gamma, limit: POLE });
        }
        let l = (S::lift(2.0 * H0 / m)).sqrt() / omega;
        let force = S::lift(F_d / m) / (l * omega * omega);
        let eta = force * (2.0 * cos_alpha) - 1.0;
        let n = force * omega * (2.0 * sin_alpha * m / (gamma * H0)) - 1.0;
        let n_eta = n * eta;
        if n_eta.re().abs() < POLE {
            let quantity =
                "n eta of the paper's law (14), by control.force, control.alpha and control.energy,";
            return Err(EvaluationError::Vanishes { quantity, value: n_eta.re().abs(), limit: POLE });
        }
        Ok(Inverse { n, eta, l })
    }

    /// Design values of the paper's law: X = n* eta* l^.
    ///
    /// # Errors
    /// As [`paper`](Self::paper).
    pub fn paper_design<S: Scalar>(&self, omega: S) -> Result<Design<S>, EvaluationError> {
        let Inverse { n, eta, l } = self.inverse(omega)?;
        let X = n * eta * l;
        let (f, g) = self.scaled(omega, X);
        Ok(Design { n, eta, X, f, g })
    }

    /// Design values of the direct law; n and eta from (15), both 0 where no limit cycle has the wanted amplitude.
    pub fn direct_design<S: Scalar>(&self, omega: S) -> Design<S> {
        let X = S::lift(self.X);
        let (f, g) = self.scaled(omega, X);
        let r = f * (2.0 * self.cos_alpha);
        let p = f / g * (4.0 * self.sin_alpha);
        let (n, eta) = match limit_cycle(r, p) {
            Some(y) => factors(p / (y * y * y) - 1.0, r / y - 1.0, y),
            None => (S::lift(0.0), S::lift(0.0)),
        };
        Design { n, eta, X, f, g }
    }

    /// X and f of the direct law.
    pub fn direct_motion<S: Scalar>(&self, omega: S) -> (S, S) {
        let X = S::lift(self.X);
        (X, self.scaled(omega, X).0)
    }

    fn scaled<S: Scalar>(&self, omega: S, X: S) -> (S, S) {
        (S::lift(self.F_d / self.m) / (omega * omega * X), omega * X * X * self.gamma)
    }
}

/// n and eta at a root y of (15), where n eta y = 1: the smaller one, a difference of nearly equal numbers, from the larger.
fn factors<S: Scalar>(n: S, eta: S, y: S) -> (S, S) {
    if n.re().abs() > eta.re().abs() { (n, S::lift(1.0) / (n * y)) } else { (S::lift(1.0) / (eta * y), eta) }
}

/// (15) scaled by X: the positive root y = l/X of `y^4 - (r + 1) y^3 - p y + p r` nearest to 1, if there is one.
fn limit_cycle<S: Scalar>(r: S, p: S) -> Option<S> {
    let (r_, p_) = (r.re(), p.re());
    if !(r_.is_finite() && p_.is_finite()) {
        return None;
    }
    let companion = Matrix::<f64, 4, 4>::from_row_slice(&[
        r_ + 1.0,
        0.0,
        p_,
        -p_ * r_, //
        1.0,
        0.0,
        0.0,
        0.0, //
        0.0,
        1.0,
        0.0,
        0.0, //
        0.0,
        0.0,
        1.0,
        0.0,
    ]);
    let roots = Dense::eigenvalues(&companion)?;
    let real = roots.iter().filter(|(re, im)| *re > 0.0 && im.abs() <= 1e-7 * re).map(|(re, _)| *re);
    let near = real.min_by(|a, b| (a - 1.0).abs().total_cmp(&(b - 1.0).abs()))?;
    // Newton's method; the last passes carry the derivative along
    let mut y = S::lift(near);
    for _ in 0..6 {
        let value = ((y - r - 1.0) * y * y - p) * y + p * r;
        let slope = (y * 4.0 - (r + 1.0) * 3.0) * y * y - p;
        if slope.vanishes() {
            break;
        }
        y -= value / slope;
    }
    y.re().is_finite().then_some(y)
}

/// Frequency ratio and damping ratio of Den Hartog's tuned absorber for the mass ratio `mu`, and the largest amplification of
/// the undamped structure with it.
#[must_use]
pub fn den_hartog(mu: f64) -> (f64, f64, f64) {
    let f = 1.0 / (1.0 + mu);
    (f, (3.0 * mu / (8.0 * (1.0 + mu).powi(3))).sqrt(), (1.0 + 2.0 / mu).sqrt())
}

/// Amplification of an undamped structure at the frequency ratio `r` with a passive absorber of mass ratio `mu`, frequency ratio
/// `f` and damping ratio `zeta` (relative to the critical damping 2 m omega of the absorber's own frequency).
#[must_use]
pub fn amplification(mu: f64, f: f64, zeta: f64, r: f64) -> f64 {
    let (f2, r2) = (f * f, r * r);
    let loss = (2.0 * zeta * f * r).powi(2);
    let above = (f2 - r2).powi(2) + loss;
    let below = ((f2 - r2) * (1.0 - r2) - mu * f2 * r2).powi(2) + loss * (1.0 - r2 - mu * r2).powi(2);
    (above / below).sqrt()
}
