/* The paper's test in C: classical Runge-Kutta around the sampled compensation, analog realization.
 * One file, with libm only; compiled at -O3 -march=native, so contraction and vector code are allowed. */
#include <math.h>
#include <stddef.h>

enum { KNOTS = 21, CELLS = 64, TRACES = 8 };

/* The order of the fields is that of `peers/plant.py`. */
typedef struct {
  double A, Av, c, Cl, CF, Gp, Gd, k, K3, Ka, Kv_per, Ks, Kvp, m, Ps, Td, xvmax, alpha, tau, kink, k2, level, mode;
  double x[KNOTS], y[KNOTS];
} Rig;

/* A piecewise linear map through a coarse index of equal cells; at most one knot per cell. */
typedef struct {
  double low, high, per_cell;
  unsigned char first[CELLS + 1];
  double x[KNOTS + 1], y[KNOTS], slope[KNOTS];
} Map;

static void build(Map *map, const double *x, const double *y) {
  map->low = x[0], map->high = x[KNOTS - 1], map->per_cell = (CELLS - 0.5) / (x[KNOTS - 1] - x[0]);
  for (int i = 0; i < KNOTS; i++) {
    map->x[i] = x[i], map->y[i] = y[i];
    map->slope[i] = i + 1 < KNOTS ? (y[i + 1] - y[i]) / (x[i + 1] - x[i]) : 0.0;
  }
  map->x[KNOTS] = INFINITY;
  for (int cell = 0; cell <= CELLS; cell++) {
    map->first[cell] = 0;
    for (int i = 1; i < KNOTS; i++)
      if ((int)((x[i] - map->low) * map->per_cell) < cell) map->first[cell] = (unsigned char)i;
  }
}

static inline double at(const Map *map, double x) {
  x = x < map->low ? map->low : x > map->high ? map->high : x;
  int i = map->first[(int)((x - map->low) * map->per_cell)];
  i += x >= map->x[i + 1];
  return map->y[i] + (x - map->x[i]) * map->slope[i];
}

typedef struct { double q, xv, P, x, v; } State;
typedef struct { double fc, rate, vc; } Input;

static inline State derivative(const Rig *r, const Map *curve, State s, Input u, double t) {
  double xv = s.xv < -1 ? -1 : s.xv > 1 ? 1 : s.xv;
  double radicand = 1 - copysign(s.P / r->Ps, s.P * xv);
  double flow = at(curve, xv) * copysign(sqrt(fabs(radicand)), radicand);
  double dP = (flow - r->Cl * s.P - r->A * s.v) * (1 / r->Ka);
  double v = r->Gp * (r->CF * (u.fc + u.rate * t - r->A * s.P) + u.vc) + r->Gd * r->CF * (u.rate - r->A * dP);
  double inner = s.x < -r->kink ? -r->kink : s.x > r->kink ? r->kink : s.x;
  int stopped = (s.xv >= 1 && s.q > 0) || (s.xv <= -1 && s.q < 0);
  return (State){
      (r->Kvp * (v - r->K3 * r->xvmax * s.xv) - s.q) * (1 / r->tau),
      stopped ? 0 : s.q * (1 / (r->Av * r->xvmax)),
      dP,
      s.v,
      (r->A * s.P - r->c * s.v - r->k2 * s.x - (r->k - r->k2) * inner) * (1 / r->m),
  };
}

static inline State plus(State s, State d, double h) {
  return (State){s.q + h * d.q, s.xv + h * d.xv, s.P + h * d.P, s.x + h * d.x, s.v + h * d.v};
}

/* One test: `traces` are force, displacement, velocity, spool, load pressure, valve command, compensation, status. */
void eft_test(const Rig *given, const double *restrict command, size_t n, double fs, int steps,
              double *restrict traces) {
  /* A local copy, which no trace can overwrite. */
  const Rig copy = *given, *r = &copy;
  Map curve, inverse;
  build(&curve, r->x, r->y);
  build(&inverse, r->y, r->x);
  const double h = 1 / (fs * steps), lag = 2 * r->alpha * r->Td / (1 - r->alpha), T = 1 / fs;
  const double pole = (lag - T) / (lag + T), gain = 2 * r->Td / (lag + T);
  double last = 0, washout = 0;
  State s = {0};
  for (size_t i = 0; i < n; i++) {
    double force = r->A * s.P, demand = r->mode == 0 ? 0 : r->A * s.v, required;
    if (r->mode == 1) {
      required = demand * r->Kv_per;
    } else {
      double radicand = 1 - copysign(force * (1 / (r->A * r->Ps)), force * s.xv);
      required = at(&inverse, demand / sqrt(radicand > 0.05 ? radicand : 0.05));
    }
    required *= r->level;
    required = required < -1 ? -1 : required > 1 ? 1 : required;
    washout = pole * washout + gain * (required - last), last = required;
    Input u = {command[i], ((i + 1 < n ? command[i + 1] : command[i]) - command[i]) * fs,
               (required + washout) / (r->Gp * r->Ks)};
    double status = (fabs(s.xv) >= 1 ? 1 : 0) + (fabs(s.x) > 0.127 ? 2 : 0) + (fabs(required) > 0.6 ? 4 : 0);
    State k1 = derivative(r, &curve, s, u, 0);
    double v = r->Gp * (r->CF * (u.fc - force) + u.vc) + r->Gd * r->CF * (u.rate - r->A * k1.P);
    double row[TRACES] = {force, s.x, s.v, s.xv, s.P, v, u.vc, status};
    for (int j = 0; j < TRACES; j++) traces[j * n + i] = row[j];
    for (int j = 0; j < steps; j++) {
      double t = j * h;
      if (j > 0) k1 = derivative(r, &curve, s, u, t);
      State k2 = derivative(r, &curve, plus(s, k1, h / 2), u, t + h / 2);
      State k3 = derivative(r, &curve, plus(s, k2, h / 2), u, t + h / 2);
      State k4 = derivative(r, &curve, plus(s, k3, h), u, t + h);
      s = plus(plus(plus(plus(s, k1, h / 6), k2, h / 3), k3, h / 3), k4, h / 6);
      s.xv = s.xv < -1 ? -1 : s.xv > 1 ? 1 : s.xv;
    }
  }
}
