"""Cauchy stresses of every law, by textbook formulae: F (3, 3) and parameters → σ (3, 3), Pa.

Those of the stress itself (Holzapfel 2000, Nonlinear Solid Mechanics, §6), differentiated by hand
from the papers that the energy files name; nothing of our generator is in them.
"""

from __future__ import annotations

import numpy as np

EYE = np.eye(3)


def hooke(p):
    young, poisson = p["young"], p["poisson"]
    return young / 2 / (1 + poisson), young * poisson / (1 + poisson) / (1 - 2 * poisson)


def dev(a):
    return a - np.trace(a) / 3 * EYE


def ln_pressure(F, p):
    """U'(J) of bulk/2 ln²J."""
    J = np.linalg.det(F)
    return p["bulk"] * np.log(J) / J * EYE


def ogden_pressure(F, p):
    """U'(J) of bulk/4 (J² - 1 - 2 ln J)."""
    J = np.linalg.det(F)
    return p["bulk"] / 2 * (J - 1 / J) * EYE


def isochoric(F):
    """J, F J^(-1/3), I1 and I2 of it."""
    J = np.linalg.det(F)
    f = J ** (-1 / 3) * F
    b = f @ f.T
    return J, f, np.trace(b), (np.trace(b) ** 2 - np.trace(b @ b)) / 2


def uncoupled(w1, w2=lambda p, i1, i2: 0.0):
    """σ = dev(2 (W1 + I1 W2) b - 2 W2 b²)/J + U' 1 of the isochoric b; W1 and W2 given."""

    def stress(F, p):
        J, f, i1, i2 = isochoric(F)
        b = f @ f.T
        first, second = w1(p, i1, i2), w2(p, i1, i2)
        return dev(2 * (first + i1 * second) * b - 2 * second * b @ b) / J + ln_pressure(F, p)

    return stress


def principal(tau):
    """J σ = Σ τ_i n_i ⊗ n_i, τ of the principal stretches."""

    def stress(F, p):
        squares, n = np.linalg.eigh(F @ F.T)
        return n @ np.diag(tau(np.sqrt(squares), p)) @ n.T / np.linalg.det(F)

    return stress


def neo_hookean(F, p):
    (mu, lmbda), J = hooke(p), np.linalg.det(F)
    return (mu * (F @ F.T - EYE) + lmbda * np.log(J) * EYE) / J


def saint_venant_kirchhoff(F, p):
    mu, lmbda = hooke(p)
    E = (F.T @ F - EYE) / 2
    return F @ (lmbda * np.trace(E) * EYE + 2 * mu * E) @ F.T / np.linalg.det(F)


def corotational_qr(F, p):
    """Edges are the axes. dF = Ω R + dR with Ω skew takes the strictly lower part of dF R⁻¹."""
    mu, lmbda = hooke(p)
    q, r = np.linalg.qr(F)
    signs = np.sign(np.diag(r))
    q, r = q * signs, signs[:, None] * r
    e = (r + r.T) / 2 - EYE
    T = lmbda * np.trace(e) * EYE + 2 * mu * e
    A = T @ r.T
    P = q @ (T - np.tril(A - A.T, -1) @ np.linalg.inv(r).T)
    return P @ F.T / np.linalg.det(F)


def stable_neo_hookean(F, p):
    """P = μ (1 - 1/(I1 + 1)) F + λ (J - α) J F^(-T), α = 1 + 3μ/(4λ); Smith 2018, eq. 18."""
    shear, first = hooke(p)
    mu, lmbda = 4 / 3 * shear, first + 5 / 6 * shear
    J, B = np.linalg.det(F), F @ F.T
    swelling = lmbda * (J - 1 - 3 * mu / (4 * lmbda))
    return mu * (1 - 1 / (np.trace(B) + 1)) * B / J + swelling * EYE


def blatz_ko(F, p):
    return p["mu"] * (EYE - np.linalg.inv(F @ F.T) / np.linalg.det(F))


def holmes_mow(F, p):
    (mu, lmbda), J, B = hooke(p), np.linalg.det(F), F @ F.T
    i1, h = np.trace(B), lmbda + 2 * mu
    i2 = (i1**2 - np.trace(B @ B)) / 2
    q = p["beta"] / h * ((2 * mu - lmbda) * (i1 - 3) + lmbda * (i2 - 3) - h * np.log(J**2))
    return np.exp(q) / (2 * J) * ((2 * mu + lmbda * (i1 - 1)) * B - lmbda * B @ B - h * EYE)


def ogden_terms(p):
    return [(p[f"mu{i}"], p[f"alpha{i}"]) for i in (1, 2, 3)]


def ogden_tau(x, p):
    """μ (x^α - its mean) of x = λ J^(-1/3); Holzapfel (2000), eq. 6.141 and after."""
    J, s = x.prod(), x * x.prod() ** (-1 / 3)
    return sum(m * (s**a - (s**a).mean()) for m, a in ogden_terms(p)) + p["bulk"] * np.log(J)


def ogden_compressible_tau(x, p):
    J = x.prod()
    return sum(m * (x**a - 1) for m, a in ogden_terms(p)) + p["lmbda"] * J * (J - 1)


def hencky_tau(x, p):
    mu, lmbda = hooke(p)
    return 2 * mu * np.log(x) + lmbda * np.log(x.prod())


def polar_tau(x, p):
    mu, lmbda = hooke(p)
    return x * (2 * mu * (x - 1) + lmbda * (x.sum() - 3))


def linear(F, p):
    mu, lmbda = hooke(p)
    e = (F + F.T) / 2 - EYE
    return (lmbda * np.trace(e) * EYE + 2 * mu * e) @ F.T / np.linalg.det(F)


def frame(p):
    """Columns f, s, f × s."""
    return np.column_stack([p["fibre"], p["sheet"], np.cross(p["fibre"], p["sheet"])])


def hooke_orthotropic(F, p):
    """Stress from the inverse of the compliance: 1/E on the diagonal, -ν_ij/E_i beside it."""
    E1, E2, E3 = p["young_f"], p["young_s"], p["young_n"]
    a, b, c = -p["poisson_fs"] / E1, -p["poisson_sn"] / E2, -p["poisson_nf"] / E3
    Q = frame(p)
    e = Q.T @ ((F + F.T) / 2 - EYE) @ Q
    T = np.diag(np.linalg.solve([[1 / E1, a, c], [a, 1 / E2, b], [c, b, 1 / E3]], np.diag(e)))
    for (i, j), g in (((0, 1), "shear_fs"), ((1, 2), "shear_sn"), ((2, 0), "shear_nf")):
        T[i, j] = T[j, i] = 2 * p[g] * e[i, j]
    return Q @ T @ Q.T @ F.T / np.linalg.det(F)


def exponential(slope):
    """c/2 (e^Q - 1) of the isochoric E; ``slope`` is ∂Q/∂E (3, 3) along the axes, Q = E:slope/2."""

    def stress(F, p):
        J, f, _, _ = isochoric(F)
        Q = frame(p) if "sheet" in p else axes_around(p["fibre"])
        E = Q.T @ (f.T @ f - EYE) @ Q / 2
        d = slope(E, p)
        S = p["c"] / 2 * np.exp((E * d).sum() / 2) * d
        return dev(f @ Q @ S @ Q.T @ f.T) / J + ln_pressure(F, p)

    return stress


def axes_around(f):
    s = np.cross(f, [0.3, -0.4, 0.5])
    s /= np.linalg.norm(s)
    return np.column_stack([f, s, np.cross(f, s)])


def costa_slope(E, p):
    rows = (("b_ff", "b_fs", "b_fn"), ("b_fs", "b_ss", "b_sn"), ("b_fn", "b_sn", "b_nn"))
    return 2 * np.array([[p[n] for n in row] for row in rows]) * E


def guccione_slope(E, p):
    f, t, fs = p["b_f"], p["b_t"], p["b_fs"]
    return 2 * np.array([[f, fs, fs], [fs, t, t], [fs, t, t]]) * E


def fung_slope(E, p):
    g, a = ([p[f"{c}_{n}"] for n in ("fs", "sn", "nf")] for c in ("g", "a"))
    shear = 2 * np.array([[0, g[0], g[2]], [g[0], 0, g[1]], [g[2], g[1], 0]]) * E
    along = [[p["a_ff"], a[0], a[2]], [a[0], p["a_ss"], a[1]], [a[2], a[1], p["a_nn"]]]
    return shear + np.diag(2 * np.array(along) @ np.diag(E))


def holzapfel_gasser_ogden(F, p):
    J, f, i1, _ = isochoric(F)
    tau = p["c"] * f @ f.T
    for a in (f @ p["fibre1"], f @ p["fibre2"]):
        e = p["kappa"] * (i1 - 3) + (1 - 3 * p["kappa"]) * (a @ a - 1)
        push = 2 * p["k1"] * max(e, 0.0) * np.exp(p["k2"] * max(e, 0.0) ** 2)
        tau = tau + push * (p["kappa"] * f @ f.T + (1 - 3 * p["kappa"]) * np.outer(a, a))
    return dev(tau) / J + ln_pressure(F, p)


def fibre_and_sheet(F, p, strain):
    """J σ of fibres, sheets and their shear; Holzapfel and Ogden (2009), eq. 5.39."""
    f, s = F @ p["fibre"], F @ p["sheet"]
    x, y, both = strain(f @ f - 1), strain(s @ s - 1), f @ s
    return (
        2 * p["a_f"] * x * np.exp(p["b_f"] * x**2) * np.outer(f, f)
        + 2 * p["a_s"] * y * np.exp(p["b_s"] * y**2) * np.outer(s, s)
        + p["a_fs"] * both * np.exp(p["b_fs"] * both**2) * (np.outer(f, s) + np.outer(s, f))
    )


def holzapfel_ogden(F, p):
    J, f, i1, _ = isochoric(F)
    matrix = p["a"] * np.exp(p["b"] * (i1 - 3)) * dev(f @ f.T)
    return (matrix + fibre_and_sheet(F, p, lambda e: max(e, 0.0))) / J + ogden_pressure(F, p)


def holzapfel_ogden_printed(F, p):
    J, B = np.linalg.det(F), F @ F.T
    matrix = p["a"] * np.exp(p["b"] * (np.trace(B) - 3)) * B
    return (matrix + fibre_and_sheet(F, p, lambda e: e)) / J + ogden_pressure(F, p)


def transversely_isotropic_mooney_rivlin(F, p):
    """The fibre adds dev(λ F' a ⊗ a)/J with λ F' as Weiss (1996) states it: no integral in it."""
    J, f, _, _ = isochoric(F)
    a = f @ p["fibre"]
    x, end = np.sqrt(a @ a), p["lam_max"]

    def toe(y):
        return p["c3"] * (np.exp(p["c4"] * (y - 1)) - 1)

    pull = 0.0 if x <= 1 else toe(x) if x < end else p["c5"] * (x - end) + toe(end)
    mooney = uncoupled(lambda p, i1, i2: p["c1"], lambda p, i1, i2: p["c2"])
    return mooney(F, p) + dev(pull * np.outer(a, a) / x**2) / J


def series_slope(p, i1, _):
    n = p["links"]
    terms = (1 / 2, i1 / (10 * n), 11 * i1**2 / (350 * n**2), 19 * i1**3 / (1750 * n**3))
    return p["mu"] * (sum(terms) + 519 * i1**4 / (134750 * n**4))


STRESS = {
    "arruda_boyce": uncoupled(series_slope),
    "blatz_ko": blatz_ko,
    "corotational_polar": principal(polar_tau),
    "corotational_qr": corotational_qr,
    "costa": exponential(costa_slope),
    "demiray": uncoupled(lambda p, i1, i2: p["mu"] / 2 * np.exp(p["b"] * (i1 - 3))),
    "fung_orthotropic": exponential(fung_slope),
    "gent": uncoupled(lambda p, i1, i2: p["mu"] / 2 * p["limit"] / (p["limit"] - i1 + 3)),
    "guccione": exponential(guccione_slope),
    "hencky": principal(hencky_tau),
    "holmes_mow": holmes_mow,
    "holzapfel_gasser_ogden": holzapfel_gasser_ogden,
    "holzapfel_ogden": holzapfel_ogden,
    "holzapfel_ogden_printed": holzapfel_ogden_printed,
    "hooke": linear,
    "hooke_orthotropic": hooke_orthotropic,
    "mooney_rivlin": uncoupled(lambda p, i1, i2: p["c1"], lambda p, i1, i2: p["c2"]),
    "mooney_rivlin_five": uncoupled(
        lambda p, i1, i2: p["c10"] + 2 * p["c20"] * (i1 - 3) + p["c11"] * (i2 - 3),
        lambda p, i1, i2: p["c01"] + 2 * p["c02"] * (i2 - 3) + p["c11"] * (i1 - 3),
    ),
    "neo_hookean": neo_hookean,
    "neo_hookean_isochoric": uncoupled(lambda p, i1, i2: p["mu"] / 2),
    "ogden": principal(ogden_tau),
    "ogden_compressible": principal(ogden_compressible_tau),
    "saint_venant_kirchhoff": saint_venant_kirchhoff,
    "stable_neo_hookean": stable_neo_hookean,
    "transversely_isotropic_mooney_rivlin": transversely_isotropic_mooney_rivlin,
    "veronda_westmann": uncoupled(
        lambda p, i1, i2: p["c1"] * p["c2"] * np.exp(p["c2"] * (i1 - 3)),
        lambda p, i1, i2: -p["c1"] * p["c2"] / 2,
    ),
    "yeoh": uncoupled(
        lambda p, i1, i2: p["c1"] + 2 * p["c2"] * (i1 - 3) + 3 * p["c3"] * (i1 - 3) ** 2
    ),
}
