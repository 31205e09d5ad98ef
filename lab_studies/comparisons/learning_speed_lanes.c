/* The rival "c lanes": as learning_speed_rival.c, with a session in each SIMD lane: sixteen with AVX-512, eight with AVX2.

   GROUPS vectors of lanes move in turn, so that the loads of one overlap with the arithmetic of the other. A lane whose
   session is over takes the next one. Values are single precision, which is enough for success percentages. States are
   numbered so that those from `live` on end an episode, which is checked by a comparison instead of a load. */

#include <immintrin.h>
#include <stdint.h>
#include <string.h>

#if defined __AVX512F__ && defined __AVX512DQ__
enum { LANES = 16 };
typedef __m512 reals;
typedef __m512i wholes;
typedef __mmask16 mask;
#define GATHER(from, at) _mm512_i32gather_ps(at, from, 4)
#define GATHER_WHOLE(from, at) _mm512_i32gather_epi32(at, from, 4)
#define SCATTER(into, at, values) _mm512_i32scatter_ps(into, at, values, 4)
#define LESS(a, b) _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ)
#define MORE_WHOLE(a, b) _mm512_cmpgt_epi32_mask(a, b)
#define EQUAL(a, b) _mm512_cmpeq_epi32_mask(a, b)
#define EITHER(m, n) ((mask)((m) | (n)))
#define SELECT(m, a, b) _mm512_mask_blend_ps(m, b, a)
#define SELECT_WHOLE(m, a, b) _mm512_mask_blend_epi32(m, b, a)
#define LARGER(a, b) _mm512_max_ps(a, b)
#define BITS(m) ((uint32_t)(m))
#define ALL(x) _mm512_set1_ps(x)
#define ALL_WHOLE(x) _mm512_set1_epi32(x)
#define ADD(a, b) _mm512_add_epi32(a, b)
#define XOR(a, b) _mm512_xor_si512(a, b)
#define AND(a, b) _mm512_and_si512(a, b)
#define LEFT(a, n) _mm512_slli_epi32(a, n)
#define RIGHT(a, n) _mm512_srli_epi32(a, n)
#define TURNED(a, n) _mm512_rol_epi32(a, n)
#define AS_REALS(a) _mm512_castsi512_ps(a)
#define AS_WHOLES(a) _mm512_castps_si512(a)
#define TO_REALS(a) _mm512_cvtepi32_ps(a)
#elif defined __AVX2__
enum { LANES = 8 };
typedef __m256 reals;
typedef __m256i wholes;
typedef __m256 mask;
#define GATHER(from, at) _mm256_i32gather_ps(from, at, 4)
#define GATHER_WHOLE(from, at) _mm256_i32gather_epi32(from, at, 4)
#define LESS(a, b) _mm256_cmp_ps(a, b, _CMP_LT_OQ)
#define MORE_WHOLE(a, b) _mm256_castsi256_ps(_mm256_cmpgt_epi32(a, b))
#define EQUAL(a, b) _mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b))
#define EITHER(m, n) _mm256_or_ps(m, n)
#define SELECT(m, a, b) _mm256_blendv_ps(b, a, m)
#define SELECT_WHOLE(m, a, b) AS_WHOLES(_mm256_blendv_ps(AS_REALS(b), AS_REALS(a), m))
#define LARGER(a, b) _mm256_max_ps(a, b)
#define BITS(m) ((uint32_t)_mm256_movemask_ps(m))
#define ALL(x) _mm256_set1_ps(x)
#define ALL_WHOLE(x) _mm256_set1_epi32(x)
#define ADD(a, b) _mm256_add_epi32(a, b)
#define XOR(a, b) _mm256_xor_si256(a, b)
#define AND(a, b) _mm256_and_si256(a, b)
#define LEFT(a, n) _mm256_slli_epi32(a, n)
#define RIGHT(a, n) _mm256_srli_epi32(a, n)
#define TURNED(a, n) _mm256_or_si256(LEFT(a, n), RIGHT(a, 32 - (n)))
#define AS_REALS(a) _mm256_castsi256_ps(a)
#define AS_WHOLES(a) _mm256_castps_si256(a)
#define TO_REALS(a) _mm256_cvtepi32_ps(a)
static inline void SCATTER(float *into, wholes at, reals values)
{
    _Alignas(32) int32_t places[LANES];
    _Alignas(32) float each[LANES];
    _mm256_store_si256((wholes *)places, at), _mm256_store_ps(each, values);
    for (int lane = 0; lane < LANES; lane++)
        into[places[lane]] = each[lane];
}
#else
#error "c lanes needs a processor with AVX2 or AVX-512"
#endif

#ifndef GROUPS
enum { GROUPS = 2 };
#endif
enum { MOVES = 6, PAIRS = 3 };

typedef union {
    wholes all;
    int32_t each[LANES];
} Wholes;

typedef union {
    reals all;
    float each[LANES];
} Reals;

/* Some sessions side by side; base: the begin of each one's table, old: the value of its state. */
typedef struct {
    Wholes base, state, made;
    Reals old, sharpness;
    wholes stream[4];
    int32_t episode[LANES];
    uint32_t going;
} Group;

/* xoshiro128+ by Blackman and Vigna, 24 bits of it as a number in [0, 1). */
static inline reals uniform(wholes s[4])
{
    const wholes sum = ADD(s[0], s[3]), shifted = LEFT(s[1], 9);
    s[2] = XOR(s[2], s[0]), s[3] = XOR(s[3], s[1]), s[1] = XOR(s[1], s[2]), s[0] = XOR(s[0], s[3]);
    s[2] = XOR(s[2], shifted), s[3] = TURNED(s[3], 11);
    return TO_REALS(RIGHT(sum, 8)) * ALL(0x1p-24f);
}

/* 2**x for x <= 0 with a relative error below 3e-7, at least 2**-126. */
static inline reals power_of_two(reals x)
{
    const reals rounder = ALL(0x1.8p23f); /* adding it leaves the nearest whole number in the lowest bits */
    x = LARGER(x, ALL(-126.0f));
    const reals whole = x + rounder, r = x - (whole - rounder), r2 = r * r;
    const reals p01 = ALL(1.0f) + r * ALL(0.69314718f), p23 = ALL(0.24022651f) + r * ALL(0.05550411f);
    const reals p45 = ALL(0.00961813f) + r * ALL(0.00133336f);
    return AS_REALS(ADD(AS_WHOLES(p01 + r2 * (p23 + r2 * p45)), LEFT(AS_WHOLES(whole), 23)));
}

typedef struct {
    const int32_t *near; /* (PAIRS, states): where moves 2p and 2p + 1 lead, in the low and the high 16 bits */
    int32_t live, max_moves, states;
    reals loss, gamma, alpha;
} Rules;

/* Makes one move of each lane, and learns from it; returns the lanes whose episode is over, as bits. */
static inline uint32_t walk(Group *g, const Rules *rules, float *value)
{
    wholes near[MOVES];
    reals v[MOVES], w[MOVES];
    for (int p = 0; p < PAIRS; p++) {
        const wholes both = GATHER_WHOLE(rules->near + (int64_t)p * rules->states, g->state.all);
        near[2 * p] = AND(both, ALL_WHOLE(0xFFFF)), near[2 * p + 1] = RIGHT(both, 16);
    }
    for (int a = 0; a < MOVES; a++)
        v[a] = GATHER(value, ADD(near[a], g->base.all));
    const reals top = LARGER(LARGER(LARGER(v[0], v[1]), LARGER(v[2], v[3])), LARGER(v[4], v[5]));
    for (int a = 0; a < MOVES; a++)
        w[a] = power_of_two((v[a] - top) * g->sharpness.all);
    const reals c1 = w[0] + w[1], c2 = c1 + w[2], c3 = c1 + (w[2] + w[3]), c4 = c3 + w[4];
    const reals sums[MOVES - 1] = {w[0], c1, c2, c3, c4};
    const reals mark = uniform(g->stream) * (c4 + w[5]);
    wholes entered = near[MOVES - 1];
    reals onward = v[MOVES - 1];
    for (int a = MOVES - 2; a >= 0; a--) {
        const mask within = LESS(mark, sums[a]);
        entered = SELECT_WHOLE(within, near[a], entered), onward = SELECT(within, v[a], onward);
    }
    const reals learned = g->old.all + rules->alpha * (rules->loss + rules->gamma * onward - g->old.all);
    SCATTER(value, ADD(g->state.all, g->base.all), learned);
    g->old.all = SELECT(EQUAL(entered, g->state.all), learned, onward); /* a move that stays meets the learned value */
    g->state.all = entered, g->made.all = ADD(g->made.all, ALL_WHOLE(1));
    const mask ends = MORE_WHOLE(entered, ALL_WHOLE(rules->live - 1));
    return BITS(EITHER(ends, MORE_WHOLE(g->made.all, ALL_WHOLE(rules->max_moves - 1))));
}

/* near (PAIRS, states): see Rules; live: states from here on end an episode; arrival, goal (states): what entering a state
   is worth, and whether it is a goal; sharpness (episodes): gamma / tau / log(2); seed (GROUPS, 4, LANES); value: room for
   a table of each lane, zeroed here. Returns all moves made; won: sessions whose last episode took `optimal` moves. */
int64_t learn(int64_t states, const int32_t *near, int64_t live, const float *arrival, const uint8_t *goal, int64_t start,
              float loss, float gamma, float alpha, int64_t episodes, const float *sharpness, int64_t max_moves,
              int64_t optimal, int64_t sessions, const uint32_t *seed, float *restrict value, int64_t *won)
{
    const Rules rules = {near, (int32_t)live, (int32_t)max_moves, (int32_t)states, ALL(loss), ALL(gamma), ALL(alpha)};
    Group groups[GROUPS];
    int64_t moves = 0, begun = 0, over = 0;
    memset(value, 0, sizeof *value * (size_t)(GROUPS * LANES * states));
    for (int n = 0; n < GROUPS; n++) {
        Group *g = groups + n;
        g->going = 0;
        for (int lane = 0; lane < LANES; lane++) {
            g->base.each[lane] = (int32_t)((n * LANES + lane) * states);
            g->episode[lane] = 0;
            g->going |= (uint32_t)(begun < sessions) << lane;
            begun += begun < sessions;
        }
        memcpy(g->stream, seed + n * 4 * LANES, sizeof g->stream);
        g->state.all = ALL_WHOLE((int32_t)start), g->made.all = ALL_WHOLE(0);
        g->old.all = ALL(0.0f), g->sharpness.all = ALL(sharpness[0]);
    }
    while (over < sessions) {
        for (int n = 0; n < GROUPS; n++) {
            Group *g = groups + n;
            for (uint32_t left = walk(g, &rules, value); left; left &= left - 1) {
                const int lane = __builtin_ctz(left);
                float *table = value + (int64_t)(n * LANES + lane) * states;
                int32_t *const state = g->state.each + lane, *const made = g->made.each + lane;
                if (*state >= live)
                    table[*state] = arrival[*state];
                const int64_t goes = g->going >> lane & 1;
                moves += goes * *made;
                if (++g->episode[lane] == episodes) {
                    over += goes, *won += goes && goal[*state] && *made == optimal;
                    g->going &= ~((uint32_t)(begun >= sessions) << lane); /* a lane without a session walks on, uncounted */
                    begun += begun < sessions;
                    memset(table, 0, sizeof *table * (size_t)states);
                    g->episode[lane] = 0;
                }
                g->sharpness.each[lane] = sharpness[g->episode[lane]];
                g->old.each[lane] = table[start];
                *state = (int32_t)start, *made = 0;
            }
        }
    }
    return moves;
}
