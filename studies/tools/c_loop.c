/* The closed loop on the assumed modes, ideal hardware, as flexsim.loop.compiled_loop and
   flexsim.plants.assumed_modes have it, operation by operation: what its cost is held against.
   Compiled by c_loop.py, whose structures have the same fields in the same order. */

#include <math.h>
#include <string.h>

#define COORDINATES_MOST 32 /* modes + 2 */
#define ORDER_MOST 64       /* coefficients of a filter */
#define HALF_TURN 3.141592653589793
#define RATE_LIMIT 1e3
#define TORQUE_MOST 1e9

typedef struct { /* AssumedModes, and how many modes there are */
    long n;
    double L_R, reach, A, J, I_m2, first_moment, F_1, F_2, r_1, r_2, step;
    const double *P, *X, *mass, *inverse_mass, *stiffness, *damping, *M, *N, *tip, *slope;
} modes;

typedef struct { /* Loop, and how many samples and coefficients there are */
    long samples, substeps, order;
    double period, L_R, reach, v_gain, v_limit;
    const double *tip, *joint, *weights;
} loop;

static void acceleration(const modes *p, const double *q, const double *w, double tau_1,
                         double tau_2, double *a, double *H1)
{
    const long n = p->n;
    const double s = sin(q[1]), c = cos(q[1]);
    const double w1 = w[0], w2 = w[1], wb = w1 + w2, Ls = p->L_R * s, Lc = p->L_R * c;
    double P_e = 0, P_d = 0, m_ee = 0, m_ed = 0, e_M_e = 0, e_M_d = 0, d_M_d = 0, e_N_e = 0;
    double e_N_d = 0, s11 = 0, s12 = 0, s22 = 0, r1 = 0, r2 = 0;
    for (long j = 0; j < n; j++) {
        const double e = q[2 + j], d = w[2 + j];
        double M_e = 0, M_d = 0, N_e = 0, D_d = 0;
        for (long i = 0; i < n; i++) {
            M_e += p->M[j * n + i] * q[2 + i];
            M_d += p->M[j * n + i] * w[2 + i];
            N_e += p->N[j * n + i] * q[2 + i];
            D_d += p->damping[j * n + i] * w[2 + i];
        }
        P_e += p->P[j] * e;
        P_d += p->P[j] * d;
        m_ee += p->mass[j] * e * e;
        m_ed += p->mass[j] * e * d;
        e_M_e += e * M_e;
        e_M_d += d * M_e;
        d_M_d += d * M_d;
        e_N_e += e * N_e;
        e_N_d += d * N_e;
        const double H1j = p->X[j] + Lc * p->P[j] - Ls * M_e, H2j = p->X[j];
        const double generalised = wb * wb * (p->mass[j] * e - N_e)
            - w1 * w1 * (Ls * p->P[j] + Lc * M_e) - p->stiffness[j] * e - D_d;
        const double inverse = p->inverse_mass[j];
        H1[j] = H1j;
        a[2 + j] = generalised * inverse;
        s11 += H1j * H1j * inverse;
        s12 += H1j * H2j * inverse;
        s22 += H2j * H2j * inverse;
        r1 += H1j * a[2 + j];
        r2 += H2j * a[2 + j];
    }
    const double straight = p->first_moment - 0.5 * e_M_e;
    const double J2 = p->J + m_ee - e_N_e, h = -Ls * P_e + Lc * straight;
    const double J2_rate = 2.0 * (m_ed - e_N_d), h_theta2 = -Lc * P_e - Ls * straight;
    const double h_rate = h_theta2 * w2 - Ls * P_d - Lc * e_M_d;
    const double g_theta2 = -Ls * P_d - Lc * e_M_d, g_rate = g_theta2 * w2 - Ls * d_M_d;
    const double bias_1 = J2_rate * wb + h_rate * (2.0 * w1 + w2) + g_rate;
    const double bias_2 = J2_rate * wb + h_rate * w1 - w1 * (h_theta2 * wb + g_theta2);
    const double b1 = p->r_1 * tau_1 - p->F_1 * w1 - bias_1 - r1;
    const double b2 = p->r_2 * tau_2 - p->F_2 * w2 - bias_2 - r2;
    const double k11 = p->A + J2 + 2.0 * h - s11, k12 = J2 + h - s12, k22 = p->I_m2 + J2 - s22;
    const double scale = 1.0 / (k11 * k22 - k12 * k12);
    const double a1 = (k22 * b1 - k12 * b2) * scale, a2 = (k11 * b2 - k12 * b1) * scale;
    a[0] = a1;
    a[1] = a2;
    for (long j = 0; j < n; j++)
        a[2 + j] -= (H1[j] * a1 + p->X[j] * a2) * p->inverse_mass[j];
}

static void rk4(const modes *p, double *state, double tau_1, double tau_2)
{
    const long m = p->n + 2;
    const double h = p->step;
    double q[COORDINATES_MOST], w[COORDINATES_MOST], a[COORDINATES_MOST];
    double dq[COORDINATES_MOST], dw[COORDINATES_MOST], H1[COORDINATES_MOST];
    for (long i = 0; i < m; i++) {
        q[i] = state[i];
        w[i] = state[m + i];
        dq[i] = dw[i] = 0;
    }
    for (int stage = 0; stage < 4; stage++) {
        acceleration(p, q, w, tau_1, tau_2, a, H1);
        const double weight = stage == 0 || stage == 3 ? h / 6.0 : h / 3.0;
        const double ahead = stage == 2 ? h : 0.5 * h;
        for (long i = 0; i < m; i++) {
            dq[i] += weight * w[i];
            dw[i] += weight * a[i];
            q[i] = state[i] + ahead * w[i];
            w[i] = state[m + i] + ahead * a[i];
        }
    }
    for (long i = 0; i < m; i++) {
        state[i] += dq[i];
        state[m + i] += dw[i];
    }
}

static double filtered(long order, const double *b, const double *a, double *z, double x)
{
    const double y = b[0] * x + z[0];
    for (long i = 0; i < order - 1; i++)
        z[i] = b[i + 1] * x - a[i + 1] * y + z[i + 1];
    return y;
}

/* One run from `state`, overwritten: the index (5), infinite where it diverged. */
double run_one(const modes *p, const loop *l, const double *b, const double *a, double *state)
{
    const long n = p->n, m = n + 2, order = l->order;
    double z[2 * ORDER_MOST], index = 0;
    memset(z, 0, sizeof z);
    for (long k = 0; k < l->samples; k++) {
        double v = 0, shortening = 0, total = 0;
        for (long j = 0; j < n; j++) {
            v += p->tip[j] * state[2 + j];
            for (long i = 0; i < n; i++)
                shortening -= 0.5 * p->slope[j * n + i] * state[2 + j] * state[2 + i];
        }
        const double along = p->reach + shortening, *joint = l->joint + 2 * k;
        for (long i = 0; i < 2 * m; i++)
            total += state[i];
        if (!(fabs(v) <= l->v_limit && fabs(state[0] - joint[0]) <= HALF_TURN
              && fabs(state[1] - joint[1]) <= HALF_TURN && fabs(state[m]) <= RATE_LIMIT
              && fabs(state[m + 1]) <= RATE_LIMIT && isfinite(total)))
            return INFINITY;
        const double edge = k == 0 || k == l->samples - 1 ? 0.5 : 1.0;
        const double th1 = state[0], th12 = state[0] + state[1], s = sin(th12), c = cos(th12);
        const double dx = l->L_R * cos(th1) + along * c - v * s - l->tip[2 * k];
        const double dy = l->L_R * sin(th1) + along * s + v * c - l->tip[2 * k + 1];
        const double t = k * l->period, *g = l->weights;
        index += edge * l->period
            * (g[0] * dx * dx + g[1] * dy * dy + g[2] * t * t * (v * v) * (v * v));
        const double e1 = joint[0] - state[0];
        const double e2 = joint[1] - (state[1] + l->v_gain * atan(v / l->reach));
        const double u1 = filtered(order, b, a, z, e1);
        const double u2 = filtered(order, b + order, a + order, z + ORDER_MOST, e2);
        if (k == l->samples - 1)
            break;
        if (!(isfinite(u1) && isfinite(u2)))
            return INFINITY;
        for (long i = 0; i < l->substeps; i++) {
            if (!(fabs(u1) + fabs(u2) <= TORQUE_MOST))
                return INFINITY;
            rk4(p, state, u1, u2);
        }
    }
    return index;
}
