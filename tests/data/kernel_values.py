#!/usr/bin/env python3
"""Values and derivatives of kernels to 60 digits at exact binary points; writes kernel_values.json beside this file.

Every kernel is a polynomial P with rational coefficients times pi^(-D/2) a^(D/2) exp(-a |z|^2) or a polynomial of its
own; P and its derivatives are formed in rational arithmetic, and only the last sum is rounded. Polynomials of the
exchange kernels are read from pse_kernels.json beside this file, all others derived here.

An entry is [value, remainder, size]: value + remainder is exact to about 1e-4 of the last place of value, and size is the
sum of the absolute terms of the formula (given below with each kernel), the unit of an error being eps * size.
Derivatives are given at every other point. Needs mpmath.
"""
import json, os, random
from fractions import Fraction as F
from itertools import product
from math import comb, factorial
from mpmath import mp, mpf, exp, pi

mp.dps = 60
HERE = os.path.dirname(os.path.abspath(__file__))


# Polynomials: {exponents: coefficient}.

def times(p, q):
    out = {}
    for a, x in p.items():
        for b, y in q.items():
            key = tuple(i + j for i, j in zip(a, b))
            out[key] = out.get(key, 0) + x * y
    return out


def evaluate(p, z):
    total = mpf(0)
    for alpha, c in p.items():
        term = mpf(c.numerator) / c.denominator
        for x, n in zip(z, alpha):
            term *= x ** n
        total += term
    return total


def absolute(p):
    return {alpha: abs(c) for alpha, c in p.items()}


def square(dim):
    return {tuple(2 * (i == axis) for i in range(dim)): F(1) for axis in range(dim)}


def radial(coefficients, dim):
    """sum_k c_k |z|^2k"""
    out, power = {}, {(0,) * dim: F(1)}
    for c in coefficients:
        for alpha, x in power.items():
            out[alpha] = out.get(alpha, 0) + c * x
        power = times(power, square(dim))
    return out


def multi_indices(dim, degrees):
    return [beta for n in degrees for beta in product(range(n + 1), repeat=dim) if sum(beta) == n]


# Entries.

def entry(value, size):
    head = float(value)
    return [head, float(mp.nstr(value - mpf(head), 5)), float(mp.nstr(size, 5))]


def gaussian(p, sizes, a, dim, points):
    """Entries of (a/pi)^(D/2) P exp(-a |z|^2), the sizes from a polynomial of absolute terms in |z_i|."""
    out = []
    for z in points:
        z = [mpf(x) for x in z]
        front = (mpf(a.numerator) / a.denominator / pi) ** (mpf(dim) / 2) * exp(-mpf(a.numerator) / a.denominator * sum(x * x for x in z))
        out.append(entry(front * evaluate(p, z), front * evaluate(sizes, [abs(x) for x in z])))
    return out


def differentiated(p, a, beta):
    """D^beta of P exp(-a |z|^2), over the exponential, by the product rule."""
    for axis, n in enumerate(beta):
        for _ in range(n):
            out = times(p, {tuple(int(i == axis) for i in range(len(beta))): -2 * a})
            for alpha, c in p.items():
                if alpha[axis]:
                    key = alpha[:axis] + (alpha[axis] - 1,) + alpha[axis + 1:]
                    out[key] = out.get(key, 0) + alpha[axis] * c
            p = out
    return {alpha: c for alpha, c in p.items() if c}


def of_radial(coefficients, beta):
    """The absolute terms of D^beta g(|z|^2), g = sum_k c_k s^k exp(-s), over exp(-s), as in
    sum_(2k <= beta) prod_i beta_i!/(k_i! (beta_i - 2 k_i)!) (2 z)^(beta - 2k) g^(|beta| - |k|)(|z|^2)."""
    dim, total, sizes = len(beta), {}, {}
    for k in product(*(range(n // 2 + 1) for n in beta)):
        profile = list(coefficients)
        for _ in range(sum(beta) - sum(k)):
            profile = [(i + 1) * profile[i + 1] - profile[i] if i + 1 < len(profile) else -profile[i] for i in range(len(profile))]
        front = F(1)
        for n, j in zip(beta, k):
            front *= F(factorial(n), factorial(j) * factorial(n - 2 * j)) * 2 ** (n - 2 * j)
        monomial = {tuple(n - 2 * j for n, j in zip(beta, k)): front}
        for out, part in ((total, radial(profile, dim)), (sizes, radial([abs(c) for c in profile], dim))):
            for alpha, c in times(monomial, part).items():
                out[alpha] = out.get(alpha, 0) + c
    p = differentiated(radial(coefficients, dim), F(1), beta)
    assert p == {alpha: c for alpha, c in total.items() if c}
    return p, sizes


def exchange():
    """The exchange kernels of pse_kernels.json."""
    with open(os.path.join(HERE, "pse_kernels.json")) as file:
        table = json.load(file)["full_space"]
    for operator, kernels in table.items():
        for key, kernel in kernels.items():
            dim, order = int(key[1]), int(key[4:])
            p = {tuple(map(int, alpha.split(","))): F(c) for alpha, c in kernel["monomials"].items()}
            yield operator, dim, order, p


# Compact kernels: sums of pieces in r = |z|, each {power of r: coefficient} on low <= r < edge.

def binomial_power(edge, n):
    """(edge - r)^n"""
    return {i: F(comb(n, i) * (-1) ** i * edge ** (n - i)) for i in range(n + 1)}


def spline(n):
    """The B-spline of degree n: its truncated powers."""
    return [((-1) ** j * comb(n + 1, j), (n + 1) // 2 - j) for j in range((n + 1) // 2)]


WENDLAND = {
    # (1 - q)^p P(q), q = r/2, by Dehnen and Aly 2012, table 1: in one dimension, and in two and three.
    "WendlandC2": [(3, [1, 3]), (4, [1, 4])],
    "WendlandC4": [(5, [1, 5, 8]), (6, [1, 6, F(35, 3)])],
    "WendlandC6": [(7, [1, 7, 19, 21]), (8, [1, 8, 25, 32])],
}
SPLINES = {"CubicSpline": 3, "QuinticSpline": 5}
LIMITS = {"CubicSpline": 2, "QuinticSpline": 4, "WendlandC2": 2, "WendlandC4": 4, "WendlandC6": 6}


def pieces(name, dim):
    """[(low, edge, [part, ...])]: W over its constant on each interval is the sum of the parts."""
    if name in SPLINES:
        n = SPLINES[name]
        parts = [(edge, {i: c * weight for i, c in binomial_power(edge, n).items()}) for weight, edge in spline(n)]
        edges = sorted(edge for edge, _ in parts)
        return [(edge - 1, edge, [part for reach, part in parts if reach >= edge]) for edge in edges]
    power, polynomial = WENDLAND[name][dim > 1]
    out = {}
    for i, c in binomial_power(2, power).items():
        for k, factor in enumerate(polynomial):
            out[i + k] = out.get(i + k, 0) + c * factor / F(2) ** (power + k)
    return [(0, 2, [out])]


def joined(parts):
    out = {}
    for part in parts:
        for i, c in part.items():
            out[i] = out.get(i, 0) + c
    return {i: c for i, c in out.items() if c}


def inner(part):
    """(1/2r) d/dr"""
    return {i - 2: c * i / 2 for i, c in part.items() if i}


def laurent(part, r):
    """The value at r, and r times the derivative there; at r = 0 the limit of parts without poles."""
    if r == 0:
        return mpf(F(part.get(0, 0)).numerator) / F(part.get(0, 0)).denominator, mpf(0)
    terms = [(i, mpf(F(c).numerator) / F(c).denominator * r ** i) for i, c in part.items()]
    return sum((x for _, x in terms), mpf(0)), sum((i * x for i, x in terms), mpf(0))


def compact(name, dim, beta, points):
    """Entries of D^beta W. The absolute terms are those of the sum of z^(beta - 2k) g_m, g_m = ((1/2r) d/dr)^m W, m =
    |beta| - |k|, where g_m counts with |g_m|: for the splines with the sum of that over the truncated powers, and below
    r = 1, where their poles cancel, of the monomials in r. For D > 1 it counts with r |dg_m/dr| more, because r is
    rounded."""
    table = pieces(name, dim)
    integral = sum(c * (F(edge) ** (i + dim) - F(low) ** (i + dim)) / (i + dim)
                   for low, edge, parts in table for i, c in joined(parts).items())
    sigma = integral.denominator / mpf(integral.numerator) / [2, 2 * pi, 4 * pi][dim - 1]
    out = []
    for z in points:
        z = [mpf(x) for x in z]
        r = abs(z[0]) if dim == 1 else sum(x * x for x in z) ** mpf("0.5")
        total, size = mpf(0), mpf(0)
        for low, edge, parts in table:
            if not low <= r < edge:
                continue
            for k in product(*(range(n // 2 + 1) for n in beta)):
                whole, single = joined(parts), list(parts)
                if name in SPLINES and low == 0 and sum(beta):
                    single = [{i: c} for i, c in whole.items()]
                for _ in range(sum(beta) - sum(k)):
                    whole, single = inner(whole), [inner(part) for part in single]
                front = mpf(1)
                for x, n, j in zip(z, beta, k):
                    front *= mpf(factorial(n)) / (factorial(j) * factorial(n - 2 * j)) * (2 * x) ** (n - 2 * j)
                total += front * laurent(whole, r)[0]
                for part in single:
                    value, slope = laurent(part, r)
                    size += abs(front) * (abs(value) + (abs(slope) if dim > 1 else 0))
        out.append(entry(sigma * total, sigma * size))
    return out


def rational(points):
    """15/(pi^2 (1 + |z|^10)): one term."""
    values = [15 / pi ** 2 / (1 + sum(mpf(x) ** 2 for x in z) ** 5) for z in points]
    return [entry(value, value) for value in values]


def hat(points):
    """2 - sum_i |z_i|, or 0."""
    sums = [sum(abs(mpf(x)) for x in z) for z in points]
    return [entry(max(2 - x, mpf(0)), 2 + x if x < 2 else mpf(0)) for x in sums]


# Mesh kernels: pieces in u = t - 1/2, t = s - floor(s).

def interpolation(p, r):
    """Lambda_{P,R} from its conditions: central differences at the integers, Hermite interpolation between."""
    half = p // 2

    def taylor(j):
        out = [F(1)] + [F(0)] * r
        for i in range(-half, half + 1):
            if i != -j:
                out = [(out[m] * -i + (out[m - 1] if m else 0)) / (-j - i) for m in range(r + 1)]
        return out

    table = []
    for j in range(half + 1):
        left, right = taylor(j), taylor(j + 1) if j < half else [F(0)] * (r + 1)
        # Unknown c_n of u^n with the given Taylor coefficients at u = -1/2 and 1/2.
        rows = [[F(comb(n, m)) * F(end) ** (n - m) if n >= m else F(0) for n in range(2 * r + 2)] + [a[m]]
                for end, a in ((F(-1, 2), left), (F(1, 2), right)) for m in range(r + 1)]
        table.append(solve(rows))
    return table


def solve(rows):
    """Gauss-Jordan elimination; the last column is the right-hand side."""
    for k in range(len(rows)):
        pivot = next(i for i in range(k, len(rows)) if rows[i][k] != 0)
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        rows = [[x - row[k] * y for x, y in zip(row, rows[k])] if i != k else row for i, row in enumerate(rows)]
    return [row[-1] for row in rows]


def piece(coefficients, degree, u):
    """A derivative in u; its absolute terms are the powers of u."""
    terms = [mpf(c.numerator) / c.denominator * factorial(n) / factorial(n - degree) * u ** (n - degree)
             for n, c in enumerate(coefficients) if n >= degree]
    return sum(terms), sum(map(abs, terms))


def interpolated(table, degree, s):
    """The m-th derivative of Lambda at s."""
    s, j = mpf(s), int(abs(s))
    value, size = piece(table[j], degree, abs(s) - j - mpf("0.5")) if j < len(table) else (mpf(0), mpf(0))
    return entry(-value if degree % 2 and s < 0 else value, size)


def weights(table, u):
    """Those of the nodes at u + (S - 1)/2 - k: the pieces from the last to the first, and their mirror images."""
    return [entry(*piece(row, 0, mpf(u))) for row in reversed(table)] + [entry(*piece(row, 0, -mpf(u))) for row in table]


# One-sided kernels.

def one_sided(beta, order, side, dim, points):
    """pi^(-D/2) (sum_j a_j z_1^j) prod_(k > 1) P(z_k^2) exp(-|z|^2) for z_1 > 0; the monomials are the terms."""
    n = beta + order - 1
    half = lambda k: mp.gamma(mpf(k + 1) / 2) / (2 * mp.sqrt(pi))
    rows = [[half(j + alpha) for j in range(1, n + 1)] + [mpf((-1) ** beta * factorial(beta)) if alpha == beta else mpf(0)]
            for alpha in range(1, n + 1)]
    a = solve(rows)
    # The identity kernel of one dimension, of the lowest even order not below beta + order.
    r = (beta + order + 1) // 2
    across = solve([[F(factorial(2 * (k + m)), factorial(k + m) * 4 ** (k + m)) for k in range(r)] + [F(int(m == 0))]
                    for m in range(r)])
    out = []
    for z in points:
        z = [mpf(x) for x in z]
        along = z[0] if side == "left" else -z[0]
        if along <= 0:
            out.append(entry(mpf(0), mpf(0)))
            continue
        front = exp(-sum(x * x for x in z)) / pi ** (mpf(dim) / 2)
        value, size = sum(c * along ** (j + 1) for j, c in enumerate(a)), sum(abs(c) * along ** (j + 1) for j, c in enumerate(a))
        for x in z[1:]:
            terms = [mpf(c.numerator) / c.denominator * x ** (2 * k) for k, c in enumerate(across)]
            value, size = value * sum(terms), size * sum(map(abs, terms))
        out.append(entry(front * value * ((-1) ** beta if side == "right" else 1), front * size))
    return out


# Points: full mantissas, so that squares do not fit a double.

def points(dim, radii, seed):
    draw = random.Random(seed)
    out = [(0.0,) * dim]
    for radius in radii:
        direction = [draw.gauss(0.0, 1.0) for _ in range(dim)]
        length = sum(x * x for x in direction) ** 0.5
        out.append(tuple(x / length * radius for x in direction))
    return out


RADII = [2.0 ** -28, 3e-3, 0.11, 0.27, 0.4, 0.55, 0.71, 0.83, 0.97, 1.13, 1.31, 1.47, 1.73, 1.9, 2.2, 2.6, 3.1, 3.7, 4.3,
         4.95, 5.000001, 5.6, 6.3]


# Exact in binary.
TENSORS = {1: [[F(3, 2)]], 2: [[F(2), F(1, 2)], [F(1, 2), F(1)]], 3: [[F(3), F(1, 2), F(-1, 4)], [F(1, 2), F(1), F(0)], [F(-1, 4), F(0), F(2)]]}
# Around the knots and edges of the compact kernels.
COMPACT = [2.0 ** -28, 0.04, 0.3, 0.62, 0.97, 1.002, 1.3, 1.6, 1.9, 1.997, 2.04, 2.5, 2.9, 2.996, 3.1]
# Inside and outside of the mesh kernels, and offsets from the middle of the nodes.
DISTANCES = [0.0, 2.0 ** -28, 0.11, -0.4999999, 0.73, 0.99999, 1.0, -1.37, 1.62, 2.05, -2.7, 3.3, 3.9, -4.41, 4.999, 5.2]
OFFSETS = [-0.5, -0.3712, -1e-3, 0.0, 0.2, 0.43]


def main():
    lists = {f"smooth{dim}": points(dim, RADII, dim) for dim in (1, 2, 3)}
    lists |= {f"compact{dim}": points(dim, COMPACT, 10 + dim) for dim in (1, 2, 3)}
    lists["distances"] = [[s] for s in DISTANCES]
    lists["offsets"] = [[u] for u in OFFSETS]
    kernels = []

    def family(kernel, dim, a, polynomials, highest, **settings):
        name = f"smooth{dim}"
        at = lambda beta, points: gaussian(*polynomials(beta), a, dim, points)
        found = {"kernel": kernel, "dim": dim, **settings, "points": name, "values": at((0,) * dim, lists[name])}
        if highest:
            every = multi_indices(dim, range(1, highest + 1))
            found["derivatives"] = {",".join(map(str, beta)): at(beta, lists[name][::2]) for beta in every}
        kernels.append(found)

    for dim in (1, 2, 3):
        one = {(0,) * dim: F(1)}
        # The monomials of the product of Hermite polynomials.
        hermite = lambda beta: differentiated(one, F(1, 2), beta)
        family("Gaussian", dim, F(1, 2), lambda beta: (hermite(beta), absolute(hermite(beta))), 4)
        family("WideGaussian", dim, F(1, 4), lambda beta: (one, one), 0)
    for operator, dim, order, p in exchange():
        if operator == "identity":
            # The terms of `of_radial`.
            c = [p[(2 * k,) + (0,) * (dim - 1)] for k in range(order // 2)]
            family("HighOrderGaussian", dim, F(1), lambda beta: of_radial(c, beta), 3, order=order)
            continue
        # The monomials of P.
        family("Exchange", dim, F(1), lambda beta: (p, absolute(p)), 0, operator=operator, order=order)
    for dim, form in TENSORS.items():
        share = sum(form[i][i] for i in range(dim)) / F(dim + 2)
        p = {}
        for i, j in product(range(dim), repeat=2):
            alpha = tuple((axis == i) + (axis == j) for axis in range(dim))
            p[alpha] = p.get(alpha, 0) + 4 * (form[i][j] - share * (i == j))
        # The monomials of 4 z . m z.
        family("AnisotropicGaussian", dim, F(1), lambda beta: (p, absolute(p)), 0, tensor=[[float(a) for a in row] for row in form])
    for name, limit in LIMITS.items():
        for dim in (1, 2, 3):
            every = multi_indices(dim, range(1, (limit if dim == 1 else min(limit, 4)) + 1))
            if (name, dim) == ("WendlandC6", 3):
                every += [(2, 2, 2), (6, 0, 0), (3, 2, 0)]
            at = lists[f"compact{dim}"]
            derivatives = {",".join(map(str, beta)): compact(name, dim, beta, at[::2]) for beta in every}
            values = compact(name, dim, (0,) * dim, at)
            kernels.append({"kernel": name, "dim": dim, "points": f"compact{dim}", "values": values, "derivatives": derivatives})
    kernels.append({"kernel": "RationalLaplacian", "dim": 3, "points": "smooth3", "values": rational(lists["smooth3"])})
    for dim in (1, 2, 3):
        kernels.append({"kernel": "LatticeHat", "dim": dim, "points": f"compact{dim}", "values": hat(lists[f"compact{dim}"])})
    for beta, order, side, dim in [(b, r, s, 1) for b in (1, 2) for r in (1, 2, 3, 4) for s in ("left", "right")] + [
            (1, 1, "left", 2), (2, 2, "right", 2), (1, 3, "left", 3)]:
        kernels.append({"kernel": "OneSidedGaussian", "dim": dim, "degree": beta, "order": order, "side": side,
                        "points": f"smooth{dim}", "values": one_sided(beta, order, side, dim, lists[f"smooth{dim}"])})
    for p, r in [(2, 1), (2, 2), (4, 2), (4, 4), (6, 4), (6, 6), (8, 4)]:
        table = interpolation(p, r)
        at = lambda degree: [interpolated(table, degree, s) for s, in lists["distances"]]
        nodes = [weights(table, u) for u, in lists["offsets"]]
        kernels.append({"kernel": "Lambda", "dim": 1, "exactness": p, "regularity": r, "points": "distances", "values": at(0),
                        "derivatives": {str(m): at(m)[::2] for m in range(1, r + 1)}, "weights": nodes})
    # The terms of the weights are 1/2 and u, and 3/4 and u^2.
    half, assigned = mpf("0.5"), {
        "Ngp": lambda u: [(mpf(1), 1)],
        "Cic": lambda u: [(half - u, half + abs(u)), (half + u, half + abs(u))],
        "Tsc": lambda u: [((half - u) ** 2 / 2, (half + abs(u)) ** 2 / 2), (mpf("0.75") - u * u, mpf("0.75") + u * u),
                          ((half + u) ** 2 / 2, (half + abs(u)) ** 2 / 2)],
    }
    for name, assign in assigned.items():
        found = [[entry(*pair) for pair in assign(mpf(u))] for u, in lists["offsets"]]
        kernels.append({"kernel": name, "dim": 1, "points": "offsets", "weights": found})
    table = {"points": lists, "kernels": kernels}
    lines = ["{\n\"points\": {"]
    lines.append(",\n".join(f"{json.dumps(name)}: {json.dumps(points, separators=(',', ':'))}" for name, points in lists.items()))
    lines.append("},\n\"kernels\": [")
    lines.append(",\n".join(json.dumps(kernel, separators=(",", ":")) for kernel in kernels))
    lines.append("]\n}\n")
    with open(os.path.join(HERE, "kernel_values.json"), "w") as file:
        file.write("\n".join(lines))


main()
