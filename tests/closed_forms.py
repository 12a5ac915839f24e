"""Solutions that several tests compare with."""

import numpy as np

#: The default `primary_oscillator`: mass, stiffness, damping, amplitude and frequency of its drive, in resonance.
M, K, C, F, OMEGA = 100.0, 15791.367041742973, 25.132741228718345, 50.0, 4.0 * np.pi
#: Amplitude once the start has died out [m]
X = F / (C * OMEGA)


def resonance(t):
    """Displacement and velocity of the default `primary_oscillator` from rest: the particular solution
    -X cos(omega t), for K = M omega^2, and the decay that starts it from rest."""
    delta = C / (2.0 * M)
    nu = np.sqrt(K / M - delta**2)
    decay = np.exp(-delta * t)
    s = X * (decay * (np.cos(nu * t) + delta / nu * np.sin(nu * t)) - np.cos(OMEGA * t))
    v = X * (OMEGA * np.sin(OMEGA * t) - decay * (K / M) / nu * np.sin(nu * t))
    return s, v
