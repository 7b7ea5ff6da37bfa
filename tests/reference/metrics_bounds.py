"""Slow, obvious twins of the posterior Cramer-Rao bound."""

import numpy as np


def spot(state, shape, psf_sigma, dx, dy):
    """Amrouche et al. (2018), eq. 9, pixel by pixel."""
    frame = np.empty(shape)
    for row in range(shape[0]):
        for column in range(shape[1]):
            square = (column * dx - state[0]) ** 2 + (row * dy - state[2]) ** 2
            frame[row, column] = dx * dy * state[-1] / (2 * np.pi * psf_sigma**2) * np.exp(-square / (2 * psf_sigma**2))
    return frame


def pixel_information(state, shape, sigma, psf_sigma, dx, dy, step=1e-5):
    """Fisher information from central differences of the spot."""
    slopes = []
    for component in range(len(state)):
        change = np.zeros(len(state))
        change[component] = step
        ahead, behind = (spot(state + sign * change, shape, psf_sigma, dx, dy) for sign in (1, -1))
        slopes.append(((ahead - behind) / (2 * step)).ravel())
    slopes = np.array(slopes)
    return slopes @ slopes.T / sigma**2


def tichavsky(F, Q, J, measured):
    """Tichavsky et al. (1998), eq. 21, as it is printed; Q must be invertible."""
    D11 = F.T @ np.linalg.inv(Q) @ F
    D12 = -F.T @ np.linalg.inv(Q)
    D22 = np.linalg.inv(Q) + measured
    return D22 - D12.T @ np.linalg.inv(J + D11) @ D12


def kalman_covariances(F, Q, H, R, P, n_frames):
    """Covariance after each measurement; the first comes without a prediction."""
    covariances = []
    for frame in range(n_frames):
        if frame:
            P = F @ P @ F.T + Q
        gain = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        P = (np.eye(len(P)) - gain @ H) @ P
        covariances.append(P)
    return np.array(covariances)
