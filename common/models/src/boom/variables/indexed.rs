//! Lists of variables with indices inside their names: `joint[1].angle` to `joint[6].angle`.

use mechanics::Scalar;
use model::{Entry, Kind, Variables, Vector3};

/// A list of numbers whose names end with an index and a suffix.
macro_rules! indexed {
    ($($(#[$doc:meta])* $name:ident [$count:literal] $suffix:literal: $($index:literal)*;)*) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, Copy, PartialEq)]
            pub struct $name<S>(pub [S; $count]);

            impl<S: Scalar> Variables<S> for $name<S> {
                const TABLE: &'static [Entry] =
                    &[$(Entry::scalar(concat!("[", $index, "]", $suffix), Kind::Float64)),*];
                #[inline]
                fn load(values: &[S]) -> Self {
                    Self(std::array::from_fn(|i| values[i]))
                }
                #[inline]
                fn store(&self, values: &mut [S]) {
                    values[..$count].copy_from_slice(&self.0);
                }
            }
        )*
    };
}

/// The same for lists of vectors.
macro_rules! indexed_vectors {
    ($($(#[$doc:meta])* $name:ident [$count:literal] $suffix:literal: $($index:literal)*;)*) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, Copy, PartialEq)]
            pub struct $name<S>(pub [Vector3<S>; $count]);

            impl<S: Scalar> Variables<S> for $name<S> {
                const TABLE: &'static [Entry] = &[$(
                    Entry::scalar(concat!("[", $index, "]", $suffix, ".x"), Kind::Float64),
                    Entry::scalar(concat!("[", $index, "]", $suffix, ".y"), Kind::Float64),
                    Entry::scalar(concat!("[", $index, "]", $suffix, ".z"), Kind::Float64),
                )*];
                #[inline]
                fn load(values: &[S]) -> Self {
                    Self(std::array::from_fn(|i| Vector3::from_column_slice(&values[3 * i..3 * i + 3])))
                }
                #[inline]
                fn store(&self, values: &mut [S]) {
                    for (to, from) in values.chunks_exact_mut(3).zip(&self.0) {
                        to.copy_from_slice(from.as_slice());
                    }
                }
            }
        )*
    };
}

/// A number of things, whole in whatever numbers the equations are evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Count<S>(pub S);

impl<S: Scalar> Variables<S> for Count<S> {
    const TABLE: &'static [Entry] = &[Entry::scalar("", Kind::Int64)];
    #[inline]
    fn load(values: &[S]) -> Self {
        Self(values[0])
    }
    #[inline]
    fn store(&self, values: &mut [S]) {
        values[0] = self.0;
    }
}

indexed! {
    /// Start angles of the joints
    AngleStarts[6] ".angle_start": 1 2 3 4 5 6;
    /// Largest rates of the joints
    RatesMax[6] ".rate_max": 1 2 3 4 5 6;
    /// Largest tangential speeds
    TangentialsMax[6] ".tangential_max": 1 2 3 4 5 6;
    /// Largest flows of extending cylinders
    FlowsMaxExtend[5] ".flow_max_extend": 2 3 4 5 6;
    /// Largest flows of retracting cylinders
    FlowsMaxRetract[5] ".flow_max_retract": 2 3 4 5 6;
    /// Commands of the joints
    Commands[6] ".velocity_command": 1 2 3 4 5 6;
    /// Angles of the joints
    Angles[6] ".angle": 1 2 3 4 5 6;
    /// Rates of the joints
    Velocities[6] ".velocity": 1 2 3 4 5 6;
    /// Second derivatives of the angles
    Accelerations[6] ".acceleration": 1 2 3 4 5 6;
    /// Torques of the weight
    GravityTorques[6] ".torque.gravity": 1 2 3 4 5 6;
    /// Torques of the load at the tip
    LoadTorques[6] ".torque.load": 1 2 3 4 5 6;
    /// Torques of the drives
    HoldingTorques[6] ".torque.holding": 1 2 3 4 5 6;
    /// Strokes
    Strokes[5] ".stroke": 2 3 4 5 6;
    /// Speeds of the pistons
    Speeds[5] ".speed": 2 3 4 5 6;
    /// Flows of the cylinders
    Flows[5] ".flow": 2 3 4 5 6;
    /// Strokes per angle
    Slopes[5] ".slope": 2 3 4 5 6;
    /// Thrusts of the cylinders
    Forces[5] ".force": 2 3 4 5 6;
    /// Pressures of the cylinders
    Pressures[5] ".pressure": 2 3 4 5 6;
    /// Quantities of arms 2 to 6
    OfArms[5] "": 2 3 4 5 6;
    /// Quantities of joints 1 to 6
    OfJoints[6] "": 1 2 3 4 5 6;
    /// Speeds of the ends of links 1 to 6 by joint 1
    Tangential1[6] "": 1 2 3 4 5 6;
    /// Speeds of the ends of links 2 to 6 by joint 2
    Tangential2[5] "": 2 3 4 5 6;
    /// Speeds of the ends of links 3 to 6 by joint 3
    Tangential3[4] "": 3 4 5 6;
    /// Speeds of the ends of links 4 to 6 by joint 4
    Tangential4[3] "": 4 5 6;
    /// Speeds of the ends of links 5 and 6 by joint 5
    Tangential5[2] "": 5 6;
    /// Speed of the end of link 6 by joint 6
    Tangential6[1] "": 6;
}

indexed_vectors! {
    /// Positions of the joints 2 to 6
    Positions[5] ".r": 1 2 3 4 5;
    /// Velocities of the joints 2 to 6
    PointVelocities[5] ".v": 1 2 3 4 5;
    /// Accelerations of the joints 2 to 6
    PointAccelerations[5] ".a": 1 2 3 4 5;
}
