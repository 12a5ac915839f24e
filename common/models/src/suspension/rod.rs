//! Mass and shape of a rod, shared by `link2` and `strut_link`.

use mechanics::Rigid;
use model::{ParameterError, SymmetricTensor, Variables, Vector3};

use super::checks::refused;

/// Mass and shape of a rod.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct RodParameters {
    /// Mass [kg]
    #[var(name = "mass", start = 4.0, above = 0.0)]
    pub mass: f64,
    /// Distance between the joint and the tip [m]
    #[var(name = "length", start = 0.400_499_687_890_015_7, above = 0.0)]
    pub length: f64,
    /// Uniform rod: com.x, inertia.yy and inertia.zz follow from mass and length
    #[var(name = "rod.uniform", start = true)]
    pub uniform: bool,
    /// Distance from the joint to the centre of mass; only with rod.uniform false [m]
    #[var(name = "com.x", start = 0.200_249_843_945_007_86, min = 0.0)]
    pub com: f64,
    /// Inertia about the rod's own axis; > 0 with joint.kind universal [kg.m2]
    #[var(name = "inertia.xx", start = 2e-3, min = 0.0)]
    pub Ixx: f64,
    /// Inertia about the centre of mass, y axis; only with rod.uniform false [kg.m2]
    #[var(name = "inertia.yy", start = 0.053_466_666_666_666_67, min = 0.0)]
    pub Iyy: f64,
    /// Inertia about the centre of mass, z axis; only with rod.uniform false [kg.m2]
    #[var(name = "inertia.zz", start = 0.053_466_666_666_666_67, min = 0.0)]
    pub Izz: f64,
}

/// What a rod's joint lets it do, as far as its inertia must fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turning {
    /// About one axis across the rod
    OneAxis,
    /// Azimuth and elevation
    Universal,
    /// Any way
    Free,
    /// Any way without spin
    Round,
}

impl RodParameters {
    /// The rod as a rigid body, x axis along it.
    ///
    /// # Errors
    /// [`ParameterError::Refused`] if the values do not fit together.
    pub(super) fn checked(&self, turning: Turning) -> Result<Rigid<3>, ParameterError> {
        let Self { mass: m, length, uniform, com, Ixx, Iyy, Izz } = *self;
        let across = m * length * length / 12.0;
        let (c, Iyy, Izz) = if uniform { (0.5 * length, across, across) } else { (com, Iyy, Izz) };
        if c > length {
            return Err(refused(
                "com.x",
                c,
                "the centre of mass lies on the rod",
                format!("0 .. {length} m"),
            ));
        }
        if Iyy + m * c * c <= 0.0 {
            return Err(refused(
                "inertia.yy",
                Iyy,
                "the inertia about the joint vanishes",
                "> 0, or com.x > 0",
            ));
        }
        if turning == Turning::Universal && Ixx <= 0.0 {
            return Err(refused(
                "inertia.xx",
                Ixx,
                "the universal joint needs it near the vertical",
                "> 0 kg.m2",
            ));
        }
        if turning == Turning::Round && (Iyy - Izz).abs() > 1e-12 * Iyy.abs() {
            let reason = "joint.kind = spherical_rod needs a rod that is round about its axis";
            return Err(refused("inertia.zz", Izz, reason, format!("inertia.yy = {Iyy} kg.m2")));
        }
        let moments = [Ixx, Iyy, Izz];
        let largest = moments.iter().copied().fold(0.0, f64::max);
        let excess = 2.0 * largest - moments.iter().sum::<f64>();
        if matches!(turning, Turning::Universal | Turning::Free) && excess > 1e-12 * largest {
            let reason =
                format!("the largest of {moments:?} exceeds the sum of the others by {excess:.3e} kg.m2");
            return Err(refused("inertia.xx", Ixx, reason, "moments that satisfy the triangle inequality"));
        }
        let I_c = SymmetricTensor::diagonal(Ixx, Iyy, Izz).matrix();
        Ok(Rigid { m, c: Vector3::new(c, 0.0, 0.0), I_c })
    }
}
