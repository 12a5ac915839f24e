//! The field types that variables are made of.

use mechanics::Scalar;

use crate::{Entry, Kind, Variables};

/// Vector with components x, y, z.
pub type Vector3<S> = nalgebra::Vector3<S>;

/// Vector in the x-z plane with components x, z.
pub type Vector2<S> = nalgebra::Vector2<S>;

/// Symmetric tensor in the x-z plane with components xx, xz, zz.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarTensor<S> {
    /// Component xx
    pub xx: S,
    /// Component xz
    pub xz: S,
    /// Component zz
    pub zz: S,
}

impl<S: Scalar> PlanarTensor<S> {
    /// Nothing.
    #[must_use]
    pub fn zero() -> Self {
        let o = S::lift(0.0);
        Self { xx: o, xz: o, zz: o }
    }

    /// As a matrix.
    pub fn matrix(&self) -> nalgebra::Matrix2<S> {
        let Self { xx, xz, zz } = *self;
        nalgebra::Matrix2::new(xx, xz, xz, zz)
    }
}

/// Symmetric tensor with components xx, xy, xz, yy, yz, zz.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SymmetricTensor<S> {
    /// Component xx
    pub xx: S,
    /// Component xy
    pub xy: S,
    /// Component xz
    pub xz: S,
    /// Component yy
    pub yy: S,
    /// Component yz
    pub yz: S,
    /// Component zz
    pub zz: S,
}

impl<S: Scalar> SymmetricTensor<S> {
    /// A tensor with the given diagonal.
    pub fn diagonal(xx: S, yy: S, zz: S) -> Self {
        let o = S::lift(0.0);
        Self { xx, xy: o, xz: o, yy, yz: o, zz }
    }

    /// Nothing.
    #[must_use]
    pub fn zero() -> Self {
        let o = S::lift(0.0);
        Self::diagonal(o, o, o)
    }

    /// The symmetric matrix `m`; of the off-diagonal components the upper ones are taken.
    #[must_use]
    pub fn from_matrix(m: &nalgebra::Matrix3<S>) -> Self {
        Self { xx: m.m11, xy: m.m12, xz: m.m13, yy: m.m22, yz: m.m23, zz: m.m33 }
    }

    /// As a matrix.
    pub fn matrix(&self) -> nalgebra::Matrix3<S> {
        let Self { xx, xy, xz, yy, yz, zz } = *self;
        nalgebra::Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }

    /// True if every component is exactly zero.
    pub fn vanishes(&self) -> bool {
        [self.xx, self.xy, self.xz, self.yy, self.yz, self.zz].iter().all(|c| c.vanishes())
    }
}

/// A group without variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoVariables;

impl<S> Variables<S> for NoVariables {
    const TABLE: &'static [Entry] = &[];
    fn load(_: &[S]) -> Self {
        Self
    }
    fn store(&self, _: &mut [S]) {}
}

impl<S: Scalar> Variables<S> for S {
    const TABLE: &'static [Entry] = &[Entry::scalar("", Kind::Float64)];
    #[inline]
    fn load(values: &[S]) -> Self {
        values[0]
    }
    #[inline]
    fn store(&self, values: &mut [S]) {
        values[0] = *self;
    }
}

impl<S: Scalar> Variables<S> for Vector3<S> {
    const TABLE: &'static [Entry] = &[
        Entry::scalar(".x", Kind::Float64),
        Entry::scalar(".y", Kind::Float64),
        Entry::scalar(".z", Kind::Float64),
    ];
    #[inline]
    fn load(values: &[S]) -> Self {
        Self::new(values[0], values[1], values[2])
    }
    #[inline]
    fn store(&self, values: &mut [S]) {
        values[..3].copy_from_slice(self.as_slice());
    }
}

impl<S: Scalar> Variables<S> for Vector2<S> {
    const TABLE: &'static [Entry] = &[Entry::scalar(".x", Kind::Float64), Entry::scalar(".z", Kind::Float64)];
    #[inline]
    fn load(v: &[S]) -> Self {
        Self::new(v[0], v[1])
    }
    #[inline]
    fn store(&self, values: &mut [S]) {
        values[..2].copy_from_slice(self.as_slice());
    }
}

impl<S: Scalar> Variables<S> for PlanarTensor<S> {
    const TABLE: &'static [Entry] = &[
        Entry::scalar(".xx", Kind::Float64),
        Entry::scalar(".xz", Kind::Float64),
        Entry::scalar(".zz", Kind::Float64),
    ];
    #[inline]
    fn load(v: &[S]) -> Self {
        Self { xx: v[0], xz: v[1], zz: v[2] }
    }
    #[inline]
    fn store(&self, v: &mut [S]) {
        v[..3].copy_from_slice(&[self.xx, self.xz, self.zz]);
    }
}

impl<S: Scalar> Variables<S> for SymmetricTensor<S> {
    const TABLE: &'static [Entry] = &[
        Entry::scalar(".xx", Kind::Float64),
        Entry::scalar(".xy", Kind::Float64),
        Entry::scalar(".xz", Kind::Float64),
        Entry::scalar(".yy", Kind::Float64),
        Entry::scalar(".yz", Kind::Float64),
        Entry::scalar(".zz", Kind::Float64),
    ];
    #[inline]
    fn load(v: &[S]) -> Self {
        Self { xx: v[0], xy: v[1], xz: v[2], yy: v[3], yz: v[4], zz: v[5] }
    }
    #[inline]
    fn store(&self, v: &mut [S]) {
        v[..6].copy_from_slice(&[self.xx, self.xy, self.xz, self.yy, self.yz, self.zz]);
    }
}

/// A quaternion or another list of four, counted from 1.
impl<S: Scalar> Variables<S> for [S; 4] {
    const TABLE: &'static [Entry] = &[
        Entry::scalar("[1]", Kind::Float64),
        Entry::scalar("[2]", Kind::Float64),
        Entry::scalar("[3]", Kind::Float64),
        Entry::scalar("[4]", Kind::Float64),
    ];
    #[inline]
    fn load(v: &[S]) -> Self {
        [v[0], v[1], v[2], v[3]]
    }
    #[inline]
    fn store(&self, v: &mut [S]) {
        v[..4].copy_from_slice(self);
    }
}

/// A pair, counted from 1.
impl<S: Scalar> Variables<S> for [S; 2] {
    const TABLE: &'static [Entry] =
        &[Entry::scalar("[1]", Kind::Float64), Entry::scalar("[2]", Kind::Float64)];
    #[inline]
    fn load(v: &[S]) -> Self {
        [v[0], v[1]]
    }
    #[inline]
    fn store(&self, v: &mut [S]) {
        v[..2].copy_from_slice(self);
    }
}

impl Variables<f64> for bool {
    const TABLE: &'static [Entry] = &[Entry::scalar("", Kind::Boolean)];
    fn load(values: &[f64]) -> Self {
        values[0] > 0.5
    }
    fn store(&self, values: &mut [f64]) {
        values[0] = f64::from(u8::from(*self));
    }
}

impl Variables<f64> for i32 {
    const TABLE: &'static [Entry] = &[Entry::scalar("", Kind::Int32)];
    #[allow(clippy::cast_possible_truncation, reason = "the export layer stores i32 values only")]
    fn load(values: &[f64]) -> Self {
        values[0] as i32
    }
    fn store(&self, values: &mut [f64]) {
        values[0] = f64::from(*self);
    }
}

impl Variables<f64> for u64 {
    const TABLE: &'static [Entry] = &[Entry::scalar("", Kind::Int64)];
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "counters are whole and not negative"
    )]
    fn load(values: &[f64]) -> Self {
        values[0] as u64
    }
    #[allow(clippy::cast_precision_loss, reason = "counters stay below 2^53")]
    fn store(&self, values: &mut [f64]) {
        values[0] = *self as f64;
    }
}
