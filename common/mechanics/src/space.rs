//! The plane x-z and space: what depends on the dimension and nothing else.

use nalgebra::{Vector2, Vector3};

use crate::{Matrix, Scalar, Vector};

/// Carries the dimension at the type level: `Dim<2>` is the plane x-z, `Dim<3>` is space.
#[derive(Debug, Clone, Copy)]
pub struct Dim<const D: usize>;

/// What differs between the plane x-z and space.
pub trait Space<const D: usize> {
    /// As a world vector; y = 0 in the plane.
    fn embed<S: Scalar>(v: &Vector<S, D>) -> Vector3<S>;
    /// The part of a world vector that acts in this space; y is dropped in the plane.
    fn restrict<S: Scalar>(v: &Vector3<S>) -> Vector<S, D>;
    /// The part of a symmetric world tensor that acts in this space.
    fn restrict_tensor<S: Scalar>(xx: S, xy: S, xz: S, yy: S, yz: S, zz: S) -> Matrix<S, D, D>;
    /// Eigenvalues and orthonormal eigenvectors (columns) of a symmetric matrix.
    fn symmetric_eigen(m: &Matrix<f64, D, D>) -> (Vector<f64, D>, Matrix<f64, D, D>);
}

impl Space<2> for Dim<2> {
    #[inline]
    fn embed<S: Scalar>(v: &Vector<S, 2>) -> Vector3<S> {
        Vector3::new(v.x, S::lift(0.0), v.y)
    }
    #[inline]
    fn restrict<S: Scalar>(v: &Vector3<S>) -> Vector<S, 2> {
        Vector2::new(v.x, v.z)
    }
    #[inline]
    fn restrict_tensor<S: Scalar>(xx: S, _: S, xz: S, _: S, _: S, zz: S) -> Matrix<S, 2, 2> {
        Matrix::<S, 2, 2>::new(xx, xz, xz, zz)
    }
    #[inline]
    fn symmetric_eigen(m: &Matrix<f64, 2, 2>) -> (Vector<f64, 2>, Matrix<f64, 2, 2>) {
        let e = m.symmetric_eigen();
        (e.eigenvalues, e.eigenvectors)
    }
}

impl Space<3> for Dim<3> {
    #[inline]
    fn embed<S: Scalar>(v: &Vector<S, 3>) -> Vector3<S> {
        *v
    }
    #[inline]
    fn restrict<S: Scalar>(v: &Vector3<S>) -> Vector<S, 3> {
        *v
    }
    #[inline]
    fn restrict_tensor<S: Scalar>(xx: S, xy: S, xz: S, yy: S, yz: S, zz: S) -> Matrix<S, 3, 3> {
        Matrix::<S, 3, 3>::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
    #[inline]
    fn symmetric_eigen(m: &Matrix<f64, 3, 3>) -> (Vector<f64, 3>, Matrix<f64, 3, 3>) {
        let e = m.symmetric_eigen();
        (e.eigenvalues, e.eigenvectors)
    }
}

/// Length of a vector, smooth enough at zero for dual numbers.
#[inline]
pub fn magnitude<S: Scalar, const D: usize>(v: &Vector<S, D>) -> S {
    let squared = v.dot(v);
    if squared.re().vanishes() { S::lift(0.0) } else { squared.sqrt() }
}
