/* The rival "c scalar": whole sessions one after another, compiled by learning_speed_rivals.py and called through ctypes.
   The compiler may compute the eight exponentials of a move side by side. */

#include <stdint.h>
#include <string.h>

enum { MOVES = 6, PADDED = 8 }; /* a row of `near` repeats the last move twice, so that vectors of eight fit it */

/* xoshiro256+ by Blackman and Vigna, 53 bits of it as a number in [0, 1). */
static inline double uniform(uint64_t s[4])
{
    const uint64_t sum = s[0] + s[3], shifted = s[1] << 17;
    s[2] ^= s[0], s[3] ^= s[1], s[1] ^= s[2], s[0] ^= s[3], s[2] ^= shifted;
    s[3] = s[3] << 45 | s[3] >> 19;
    return (double)(sum >> 11) * 0x1p-53;
}

/* exp(x) for x <= 0 with an error below 1e-13, at least exp(-700). It has no branches, unlike the library's. */
static inline double exp_of(double x)
{
    const double rounder = 0x1.8p52; /* adding it leaves the nearest whole number in the lowest bits */
    x = x < -700.0 ? -700.0 : x;
    const double doublings = x * 1.4426950408889634 + rounder;
    const double r = x - (doublings - rounder) * 0.6931471805599453, r2 = r * r, r4 = r2 * r2;
    const double p01 = 1.0 + r, p23 = 1.0 / 2 + r * (1.0 / 6), p45 = 1.0 / 24 + r * (1.0 / 120);
    const double p67 = 1.0 / 720 + r * (1.0 / 5040), p89 = 1.0 / 40320 + r * (1.0 / 362880);
    const double p1011 = 1.0 / 3628800 + r * (1.0 / 39916800);
    const double p = p01 + r2 * p23 + r4 * (p45 + r2 * p67) + r4 * r4 * (p89 + r2 * p1011);
    uint64_t power, bits;
    double result;
    memcpy(&power, &doublings, sizeof power);
    memcpy(&bits, &p, sizeof bits);
    bits += power << 52;
    memcpy(&result, &bits, sizeof result);
    return result;
}

static inline double larger(double a, double b) { return a > b ? a : b; }

/* The index of the move that u in [0, 1) picks from the softmax over the values of the neighbours t. */
static inline int choose(const double *value, const uint16_t *t, double sharpness, double u)
{
    double v[PADDED], w[PADDED];
    for (int a = 0; a < PADDED; a++)
        v[a] = value[t[a]];
    const double top = larger(larger(larger(v[0], v[1]), larger(v[2], v[3])), larger(v[4], v[5]));
#pragma GCC unroll 1 /* kept a loop, gcc makes vectors of it; unrolled, it does not */
    for (int a = 0; a < PADDED; a++)
        w[a] = exp_of((v[a] - top) * sharpness);
    const double c1 = w[0] + w[1], c2 = c1 + w[2], c3 = c1 + (w[2] + w[3]), c4 = c3 + w[4];
    const double mark = u * (c3 + (w[4] + w[5]));
    return ((w[0] <= mark) + (c1 <= mark)) + ((c2 <= mark) + (c3 <= mark)) + (c4 <= mark);
}

/* near (states, PADDED): where each move leads; arrival, ends (states): what entering a state is worth, and whether
   the episode ends there (1 in a goal, 2 elsewhere); sharpness (episodes): gamma / tau; value (states): room for the
   table. Returns all moves made; won: sessions whose last episode took `optimal` moves to the goal. */
int64_t learn(int64_t states, const uint16_t *near, const double *arrival, const uint8_t *ends, int64_t start,
              double loss, double gamma, double alpha, int64_t episodes, const double *sharpness, int64_t max_moves,
              int64_t optimal, int64_t sessions, const uint64_t *seed, double *restrict value, int64_t *won)
{
    int64_t moves = 0;
    uint64_t stream[4] = {seed[0], seed[1], seed[2], seed[3]};
    for (int64_t session = 0; session < sessions; session++) {
        int64_t state = start, made = 0;
        memset(value, 0, (size_t)states * sizeof *value);
        for (int64_t n = 0; n < episodes; n++) {
            state = start;
            for (made = 0; made < max_moves && !ends[state]; made++) {
                const uint16_t *t = near + PADDED * state;
                const int64_t entered = t[choose(value, t, sharpness[n], uniform(stream))];
                value[state] += alpha * (loss + gamma * value[entered] - value[state]);
                state = entered;
            }
            if (ends[state])
                value[state] = arrival[state];
            moves += made;
        }
        *won += ends[state] == 1 && made == optimal;
    }
    return moves;
}
