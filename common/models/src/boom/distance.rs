//! Exact distance of two boxes.
//!
//! Two boxes are apart if and only if one of 15 directions separates them: the face normals of both and the cross
//! products of their edges; the largest gap along these directions is a lower bound of the distance. Where the boxes
//! are apart, the distance is attained between a corner of one box and the other box, or between the insides of two
//! edges; all these pairs are looked at, so that there is no iteration and no tolerance. A distance below 1e-9 m is
//! contact, reported as -1 (B18).
//!
//! Source: S. Gottschalk, M. C. Lin, D. Manocha, OBBTree, SIGGRAPH 1996 (separating axes).

use model::Vector3;

use super::machine::PlacedBox;

/// Boxes nearer than this touch [m].
const CONTACT: f64 = 1e-9;
/// What boxes in contact report instead of a distance.
pub(crate) const TOUCHING: f64 = -1.0;
/// Square of the sine below which edges count as parallel: then a corner is as near to rounding.
const PARALLEL: f64 = 1e-20;
/// Square of the sine below which the cross product of two edges is no direction to separate along.
const NO_DIRECTION: f64 = 1e-12;

/// The nearest box to one box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Nearest {
    /// Distance [m], -1 in contact
    pub(crate) distance: f64,
    /// Which one, from 0; the first of those that are equally near
    pub(crate) index: usize,
    /// Pairs of boxes whose features were looked at
    pub(crate) evaluations: usize,
}

/// The nearest of the boxes `others`; those whose lower bound excludes them are looked at no further.
pub(crate) fn nearest(one: &PlacedBox, others: &[PlacedBox]) -> Nearest {
    let mut best = Nearest { distance: f64::INFINITY, index: 0, evaluations: 0 };
    for (index, other) in others.iter().enumerate() {
        let pair = Pair::new(one, other);
        if pair.spheres() > best.distance {
            continue;
        }
        best.evaluations += 1;
        let distance = pair.distance(best.distance);
        if distance < best.distance {
            (best.distance, best.index) = (distance, index);
        }
    }
    best
}

/// Distance of two boxes [m]; -1 if they touch or overlap.
#[must_use]
pub fn distance(one: &PlacedBox, other: &PlacedBox) -> f64 {
    Pair::new(one, other).distance(f64::INFINITY)
}

/// Two boxes, seen from the axes of the first.
struct Pair<'a> {
    one: &'a PlacedBox,
    other: &'a PlacedBox,
    /// From the first centre to the second, in the axes of the first, of the second
    offset: [[f64; 3]; 2],
    /// Cosines between the axes
    cosines: [[f64; 3]; 3],
}

impl<'a> Pair<'a> {
    fn new(one: &'a PlacedBox, other: &'a PlacedBox) -> Self {
        let between = other.center - one.center;
        let along = |b: &PlacedBox| b.axes.map(|axis| axis.dot(&between));
        let cosines = one.axes.map(|a| other.axes.map(|b| a.dot(&b)));
        Self { one, other, offset: [along(one), along(other)], cosines }
    }

    /// Lower bound of the distance from the spheres around the boxes.
    fn spheres(&self) -> f64 {
        let radius = |b: &PlacedBox| Vector3::from(b.half).norm();
        Vector3::from(self.offset[0]).norm() - radius(self.one) - radius(self.other)
    }

    /// Largest gap along the 15 directions; not positive: no direction separates.
    fn gap(&self) -> f64 {
        let Self { offset: [p, r], cosines: c, .. } = self;
        let (a, b) = (&self.one.half, &self.other.half);
        let mut gap = f64::NEG_INFINITY;
        for i in 0..3 {
            let reach = a[i] + (0..3).map(|j| b[j] * c[i][j].abs()).sum::<f64>();
            gap = gap.max(p[i].abs() - reach);
            let reach = b[i] + (0..3).map(|j| a[j] * c[j][i].abs()).sum::<f64>();
            gap = gap.max(r[i].abs() - reach);
        }
        for i in 0..3 {
            for j in 0..3 {
                let sine_2 = 1.0 - c[i][j] * c[i][j];
                if sine_2 < NO_DIRECTION {
                    continue;
                }
                let ([k, l], [m, n]) = ([(i + 1) % 3, (i + 2) % 3], [(j + 1) % 3, (j + 2) % 3]);
                let reach =
                    a[k] * c[l][j].abs() + a[l] * c[k][j].abs() + b[m] * c[i][n].abs() + b[n] * c[i][m].abs();
                let along = p[l] * c[k][j] - p[k] * c[l][j];
                gap = gap.max((along.abs() - reach) / sine_2.sqrt());
            }
        }
        gap
    }

    /// The distance; where it is certainly not below `enough`, a lower bound.
    fn distance(&self, enough: f64) -> f64 {
        let gap = self.gap();
        if gap <= 0.0 {
            return TOUCHING;
        }
        if gap > enough {
            return gap;
        }
        let square = corners(self.one, self.other).min(corners(self.other, self.one)).min(self.edges());
        let distance = square.sqrt();
        if distance < CONTACT { TOUCHING } else { distance }
    }

    /// Square of the distance between the insides of edges.
    fn edges(&self) -> f64 {
        let mut least = f64::INFINITY;
        for i in 0..3 {
            for j in 0..3 {
                let cosine = self.cosines[i][j];
                if 1.0 - cosine * cosine > PARALLEL {
                    least = least.min(self.edges_along(i, j, cosine));
                }
            }
        }
        least
    }

    /// The same for the edges along axis `i` of one box and `j` of the other.
    fn edges_along(&self, i: usize, j: usize, cosine: f64) -> f64 {
        let (u, v) = (&self.one.axes[i], &self.other.axes[j]);
        let (length_u, length_v) = (self.one.half[i], self.other.half[j]);
        let sine_2 = 1.0 - cosine * cosine;
        let between = self.other.center - self.one.center;
        let mut least = f64::INFINITY;
        for to_one in across(self.one, i) {
            for to_other in across(self.other, j) {
                let w = between + to_other - to_one;
                let (along_u, along_v) = (w.dot(u), w.dot(v));
                // on |w + t v - s u|: s - t cos = w.u, s cos - t = w.v
                let t = (cosine * along_u - along_v) / sine_2;
                let s = along_u + t * cosine;
                if s.abs() <= length_u && t.abs() <= length_v {
                    least = least.min((w + v * t - u * s).norm_squared());
                }
            }
        }
        least
    }
}

/// From the centre to the middles of the four edges along axis `i`.
fn across(b: &PlacedBox, i: usize) -> [Vector3<f64>; 4] {
    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
    let (y, z) = (b.axes[j] * b.half[j], b.axes[k] * b.half[k]);
    [y + z, y - z, -y + z, -y - z]
}

/// Square of the least distance of the corners of `one` from the box `other`.
fn corners(one: &PlacedBox, other: &PlacedBox) -> f64 {
    let between = one.center - other.center;
    let center = other.axes.map(|axis| axis.dot(&between));
    let edge = |i: usize| other.axes.map(|axis| axis.dot(&one.axes[i]) * one.half[i]);
    let edges = [edge(0), edge(1), edge(2)];
    let mut least = f64::INFINITY;
    for corner in 0..8_u8 {
        let mut square = 0.0;
        for c in 0..3 {
            let sign = |i: usize| if corner >> i & 1 == 0 { 1.0 } else { -1.0 };
            let x: f64 = center[c] + (0..3).map(|i| sign(i) * edges[i][c]).sum::<f64>();
            let outside = (x.abs() - other.half[c]).max(0.0);
            square += outside * outside;
        }
        least = least.min(square);
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Unit};
    use proptest::prelude::*;

    fn upright(center: [f64; 3], half: [f64; 3]) -> PlacedBox {
        PlacedBox { center: center.into(), half, axes: [Vector3::x(), Vector3::y(), Vector3::z()] }
    }

    fn turned(b: &PlacedBox, r: &Rotation3<f64>, shift: Vector3<f64>) -> PlacedBox {
        PlacedBox { center: r * b.center + shift, half: b.half, axes: b.axes.map(|a| r * a) }
    }

    /// E4: touching faces, edges and corners report -1, a gap of 1e-6 m is reported within 1e-8 m.
    #[test]
    fn contact_is_exact() {
        let one = upright([0.0; 3], [1.0, 2.0, 3.0]);
        for direction in [[2.0, 0.0, 0.0], [2.0, 4.0, 0.0], [2.0, 4.0, 6.0]] {
            let touching = upright(direction, [1.0, 2.0, 3.0]);
            assert!((distance(&one, &touching) + 1.0).abs() < 1e-15);
            let mut apart = touching;
            apart.center.x += 1e-6;
            assert!((distance(&one, &apart) - 1e-6).abs() < 1e-8);
        }
        // an edge of a cube that stands on its edge, above the face of the other
        let r = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_4);
        for (gap, expected) in [(0.0, -1.0), (5e-10, -1.0), (1e-6, 1e-6)] {
            let height = 3.0 + 2.0_f64.sqrt() + gap;
            let cube = turned(&upright([0.0; 3], [1.0; 3]), &r, Vector3::new(0.2, 0.1, height));
            assert!((distance(&one, &cube) - expected).abs() < 1e-8);
        }
    }

    /// Two crossed edges: the distance is that of their lines.
    #[test]
    fn crossed_edges() {
        let one = turned(
            &upright([0.0; 3], [5.0, 1.0, 1.0]),
            &Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_4),
            Vector3::zeros(),
        );
        let other = turned(
            &upright([0.0; 3], [1.0, 5.0, 1.0]),
            &Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_4),
            Vector3::new(0.3, 0.2, 2.0 * 2.0_f64.sqrt() + 0.7),
        );
        assert!((distance(&one, &other) - 0.7).abs() < 1e-12);
    }

    /// Bounds of the distance by alternating projections onto the two boxes: the points reached are no nearer than it, the
    /// gap along their connection is no wider.
    fn bounds(one: &PlacedBox, other: &PlacedBox) -> [f64; 2] {
        let onto = |b: &PlacedBox, p: &Vector3<f64>| {
            let mut q = b.center;
            for (axis, half) in b.axes.iter().zip(b.half) {
                q += axis * axis.dot(&(p - b.center)).clamp(-half, half);
            }
            q
        };
        let mut p = one.center;
        let mut q = onto(other, &p);
        for _ in 0..2000 {
            let before = p;
            p = onto(one, &q);
            q = onto(other, &p);
            if (p - before).norm() < 1e-14 {
                break;
            }
        }
        let apart = (q - p).norm();
        if apart <= 0.0 {
            return [0.0; 2];
        }
        let n = (q - p) / apart;
        let reach = |b: &PlacedBox| b.axes.iter().zip(b.half).map(|(a, h)| h * a.dot(&n).abs()).sum::<f64>();
        [n.dot(&(other.center - one.center)) - reach(one) - reach(other), apart]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]
        /// Between the bounds that alternating projections give, which meet where these converge fast.
        #[test]
        fn lies_between_its_bounds(
            half in prop::array::uniform6(0.1..3.0),
            axis in prop::array::uniform3(-1.0..1.0),
            angle in -3.0..3.0,
            shift in prop::array::uniform3(-5.0..5.0),
        ) {
            prop_assume!(Vector3::from(axis).norm() > 0.1);
            let one = upright([0.0; 3], [half[0], half[1], half[2]]);
            let r = Rotation3::from_axis_angle(&Unit::new_normalize(axis.into()), angle);
            let other = turned(&upright([0.0; 3], [half[3], half[4], half[5]]), &r, shift.into());
            let (found, [lower, upper]) = (distance(&one, &other), bounds(&one, &other));
            prop_assert!((distance(&other, &one) - found).abs() < 1e-12);
            prop_assert!(lower <= found.max(CONTACT) + 1e-12, "{} below {}", found, lower);
            prop_assert!(found <= upper + 1e-12, "{} above {}", found, upper);
        }
    }
}
