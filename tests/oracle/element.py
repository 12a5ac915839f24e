"""One rigid element on a moving joint: equations (4)-(12c), (15), (16), (21) of the suspension specification in three
dimensions, with cross products. Planar elements are the same equations with the y components of all vectors left out.

Nothing here is minimal or fast: every force is a vector, P is formed by a dense solve, and inputs may be complex, so that
a complex step gives exact derivatives. Shares no code with the product.
"""

from dataclasses import dataclass

import numpy as np

E = np.eye(3)
Y = E[1]


def skew(v):
    """The matrix of v x."""
    return np.cross(v, E, axisb=0, axisc=0)


@dataclass(frozen=True)
class Attitude:
    """Orientation and its rate in the world frame: alpha = H q'' + gamma."""

    R: np.ndarray
    omega: np.ndarray
    H: np.ndarray
    gamma: np.ndarray


def by_angles(phi, theta, phi_dot, theta_dot):
    """Universal joint (1)-(3)."""
    sp, cp, st, ct = np.sin(phi), np.cos(phi), np.sin(theta), np.cos(theta)
    R = np.array([[ct * cp, -sp, -st * cp], [ct * sp, cp, -st * sp], [st, 0.0, ct]])
    H = np.array([[0.0, 0.0, 1.0], [sp, -cp, 0.0]]).T
    return Attitude(R, H @ [phi_dot, theta_dot], H, phi_dot * theta_dot * np.array([cp, sp, 0.0]))


def by_hinge(phi, theta, theta_dot):
    """Revolute joint about -y of the azimuth phi; planar with phi = 0."""
    turned = by_angles(phi, theta, 0.0, theta_dot)
    return Attitude(turned.R, turned.omega, turned.H[:, 1:], np.zeros(3))


def by_quaternion(q, omega):
    """Ball joint; q = (w, x, y, z) turns body vectors into world vectors."""
    w, u = q[0], np.asarray(q[1:])
    R = (w * w - u @ u) * E + 2.0 * np.outer(u, u) + 2.0 * w * skew(u)
    return Attitude(R, np.asarray(omega), E, np.zeros(3))


def by_direction(d, omega):
    """Rod without spin along d: two columns that span the plane across d."""
    d = np.asarray(d)
    across = np.cross(d, E[np.argmin(np.abs(d))])
    across /= np.linalg.norm(across)
    other = np.cross(d, across)
    return Attitude(np.array([d, across, other]).T, np.asarray(omega), np.array([across, other]).T, np.zeros(3))


@dataclass(frozen=True)
class Load:
    """F - M a at a point; p is a body vector from the joint."""

    p: np.ndarray
    F: np.ndarray
    M: np.ndarray


@dataclass(frozen=True)
class Strut:
    """Spring and damper between the body point s and a point T of the chassis."""

    s: np.ndarray
    k: float
    c: float
    l0: float
    preload: float

    def tension(self, r, v):
        """Length, its rate, tension (15), (16) and direction; r, v: T as seen from S."""
        length = np.sqrt(r @ r)
        e = r / length
        rate = e @ v
        return length, rate, self.k * (length - self.l0) + self.c * rate - self.preload, e


@dataclass(frozen=True)
class Element:
    """Constants of an element: mass, centre of mass from the joint and inertia about it (body axes), gravity."""

    m: float
    c: np.ndarray
    I: np.ndarray
    g: np.ndarray
    planar: bool = False
    strut: Strut | None = None

    def _plane(self, v):
        """The part of a vector or tensor that acts."""
        v = np.asarray(v)
        if not self.planar:
            return v
        keep = E - np.outer(Y, Y)
        return keep @ v if v.ndim == 1 else keep @ v @ keep

    def matrices(self, at, loads):
        """m, c, J, S, P of (12a) in the world frame, with the inertia of the slots."""
        c = at.R @ self._plane(self.c)
        J_A = at.R @ (self.I + self.m * ((self.c @ self.c) * E - np.outer(self.c, self.c))) @ at.R.T
        J, S = J_A.astype(complex), self.m * skew(c).astype(complex)
        for load in loads:
            p = skew(at.R @ self._plane(load.p))
            M = self._plane(load.M)
            J = J + p @ M @ p.T
            S = S + p @ M
        P = at.H @ np.linalg.solve(at.H.T @ J @ at.H, at.H.T)
        return c, J_A, J, S, P

    def two_port(self, at, loads, p):
        """M at the root, G and Y for an unknown force at the body point p (11), (12c)."""
        _, _, _, S, P = self.matrices(at, loads)
        r = skew(at.R @ self._plane(p))
        M = self.m * E + sum(self._plane(load.M) for load in loads) - S.T @ P @ S
        return tuple(self._plane(part).real for part in (M, E - S.T @ P @ r, r @ P @ r.T))

    def evaluate(self, at, root, loads, points=(), torque=np.zeros(3), top=None):
        """Everything an element reports. `root` = r, v, a of the joint; `top` = r, v of the strut's chassis point.

        Also "scale": size of the terms that are summed in the forces and moments.
        """
        r_A, v_A, a_A = (self._plane(part) for part in root)
        g, w = self._plane(self.g), at.omega
        given = list(loads)
        result = {}
        if self.strut is not None:
            s = at.R @ self.strut.s
            r_T, v_T = (self._plane(part) for part in top)
            length, rate, tension, e = self.strut.tension(r_T - r_A - s, v_T - v_A - np.cross(w, s))
            given.append(Load(self.strut.s, tension * e, np.zeros((3, 3))))
            stretch = length - self.strut.l0
            result |= {"length": length, "rate": rate, "force": tension, "T.F": -tension * e}
            result["dissipated'"] = self.strut.c * rate * rate
        c, J_A, J, S, P = self.matrices(at, given)
        turning = lambda p: np.cross(w, np.cross(w, p))
        known = [(at.R @ self._plane(load.p), self._plane(load.F), self._plane(load.M)) for load in given]
        gyro = np.cross(w, J_A @ w)

        # (12a), (12b)
        tau = self.m * np.cross(c, g) - gyro + torque
        F0 = self.m * g - self.m * turning(c)
        M = self.m * E.astype(complex)
        for p, F, M_k in known:
            tau = tau + np.cross(p, F - M_k @ turning(p))
            F0 = F0 + F - M_k @ turning(p)
            M = M + M_k
        alpha_0 = at.gamma + P @ (tau - J @ at.gamma)
        result["F0"] = self._plane(F0 - S.T @ alpha_0)
        result["M"] = self._plane(M - S.T @ P @ S)

        # (6)-(9), every load with the acceleration of its own point
        alpha = alpha_0 - P @ S @ a_A
        of = lambda p: self._plane(a_A + np.cross(alpha, p) + turning(p))
        velocity = lambda p: v_A + np.cross(w, p)
        a_c = of(c)
        acting = [(p, F - M_k @ of(p)) for p, F, M_k in known]
        F_A = self.m * (g - a_c) + sum(F for _, F in acting)
        own = [-(J_A @ alpha), -gyro, self.m * np.cross(c, g - a_A), torque]
        moments = [np.cross(p, F) for p, F in acting] + own
        result["F"] = self._plane(F_A)
        result["moment"] = sum(moments)
        result["alpha"] = alpha
        for name, p in points:
            p = at.R @ self._plane(p)
            result[name] = {"r": r_A + p, "v": self._plane(velocity(p)), "a": of(p)}
        result["scale"] = {
            "force": max(np.abs(part).max() for part in [self.m * g, self.m * a_c, F_A, *(F for _, F in acting)]),
            "moment": max(np.abs(part).max() for part in moments),
        }

        # (21)
        v_c = velocity(c)
        I = at.R @ self.I @ at.R.T
        result["kinetic"] = 0.5 * self.m * (v_c @ v_c) + 0.5 * (w @ I @ w)
        result["potential"] = -self.m * (g @ (r_A + c))
        power = sum(F @ velocity(p) for p, F in acting[: len(loads)]) - F_A @ v_A
        if self.strut is not None:
            result["potential"] += 0.5 * self.strut.k * stretch * stretch - self.strut.preload * stretch
            power = power - result["T.F"] @ v_T
        result["port'"] = power
        result["supplied'"] = power + torque @ w
        # kinetic' + potential' by the chain rule
        result["stored'"] = self.m * (v_c @ a_c) + w @ (I @ alpha + np.cross(w, I @ w)) - self.m * (g @ v_c)
        if self.strut is not None:
            result["stored'"] += (self.strut.k * stretch - self.strut.preload) * rate
        return result
