// weighted_units: y [R,N] = the sum over a ray's samples of weight [R,S] * relu(x [R S,C] . w [C,N] + term), without the
// samples lighter than `threshold`. term has one row for all rays (term_stride 0) or one for each (term_stride N). With
// rows [R,S], x holds only some of the samples: row rows[i] is that of sample i, and samples without one weigh nothing.
//
//   CPU form: the samples of a ray that weigh something go GROUP at a time through a register tile of all N units.
//   The gradient stages their d = weight * grad_y where the unit is on; every STAGED samples become
//   grad_x = d . w^T and grad_w += x^T . d, while x and d are still in the first cache.
#include "lanes.clh"
#ifndef INNER
#define INNER 16
#endif
#ifndef INNER_LANES
#define INNER_LANES 16
#endif
#ifndef GROUP
#define GROUP 3
#endif
#ifndef LAYER_ROWS
#define LAYER_ROWS 4
#endif
#ifndef LAYER_VECTORS
#define LAYER_VECTORS 1
#endif
// 0: the gradient of the layer alone, where the samples are frozen.
#ifndef SAMPLE_GRADIENT
#define SAMPLE_GRADIENT 1
#endif
#define STAGED 24
#ifndef HAS_ROWS
#define HAS_ROWS 0
#endif
#if HAS_ROWS
#define ROW(i) max(rows[i], 0)  // -1 where a weight that is no number is met
#else
#define ROW(i) (i)
#endif
#define EACH(i, count) UNROLL for (int i = 0; i < (count); ++i)

#if GPU_FORM

// The units of one sample that one vector holds, before the ReLU.
inline LANE preactivation(IN REAL* x, IN REAL* w, IN REAL* term) {
  LANE acc = LOAD(term);
  for (int k = 0; k < INNER; ++k) acc += x[k] * LOAD(w + k * CHANNELS);
  return acc;
}

KERNEL void weighted_units(IN REAL* restrict weight, IN REAL* restrict x, IN REAL* restrict w, IN REAL* restrict term,
                           IN int* restrict rows, GLOBAL REAL* restrict y, int rays, int samples, int term_stride,
                           REAL threshold) {
  const int c = get_global_id(0) * LANES, ray = get_global_id(1);
  if (ray >= rays || c >= CHANNELS) return;
  LANE sum = (LANE)(0);
  for (int i = ray * samples; i < (ray + 1) * samples; ++i) {
    if (weight[i] < threshold) continue;
    const LANE units = preactivation(x + (size_t)ROW(i) * INNER, w + c, term + (size_t)ray * term_stride + c);
    sum += weight[i] * fmax(units, (LANE)(0));
  }
  STORE(sum, y + (size_t)ray * CHANNELS + c);
}

// One work-item per sample.
KERNEL void weighted_units_sample_gradient(IN REAL* restrict weight, IN REAL* restrict x, IN REAL* restrict w,
                                           IN REAL* restrict term, IN REAL* restrict grad_y,
                                           GLOBAL REAL* restrict grad_weight, GLOBAL REAL* restrict grad_x, int rays,
                                           int samples, int term_stride, REAL threshold) {
  const int i = get_global_id(0), ray = i / samples;
  if (ray >= rays) return;
  const REAL heaviness = weight[i];
  REAL grad[INNER];
  for (int k = 0; k < INNER; ++k) grad[k] = 0;
  LANE dot = (LANE)(0);
  for (int c = 0; c < CHANNELS && !(heaviness < threshold); c += LANES) {
    const LANE units = fmax(
        preactivation(x + (size_t)i * INNER, w + c, term + (size_t)ray * term_stride + c), (LANE)(0));
    const LANE g = LOAD(grad_y + (size_t)ray * CHANNELS + c);
    dot += g * units;
    const LANE d = units > (LANE)(0) ? heaviness * g : (LANE)(0);
    for (int k = 0; k < INNER; ++k) grad[k] += sum_lanes(d * LOAD(w + k * CHANNELS + c));
  }
  grad_weight[i] = sum_lanes(dot);
  for (int k = 0; k < INNER; ++k) grad_x[(size_t)i * INNER + k] = grad[k];
}

// One work-item per vector of units and chunk of rays.
KERNEL void weighted_units_layer_gradient(IN REAL* restrict weight, IN REAL* restrict x, IN REAL* restrict w,
                                          IN REAL* restrict term, IN int* restrict rows, IN REAL* restrict grad_y,
                                          GLOBAL REAL* restrict grad_term, GLOBAL REAL* restrict partial, int rays,
                                          int samples, int term_stride, REAL threshold, int chunk_rays) {
  const int c = get_global_id(0) * LANES, chunk = get_global_id(1);
  const int first = chunk * chunk_rays, end = min(first + chunk_rays, rays);
  if (first >= rays || c >= CHANNELS) return;
  LANE grad[INNER], of_term = (LANE)(0);
  for (int k = 0; k < INNER; ++k) grad[k] = (LANE)(0);
  for (int ray = first; ray < end; ++ray) {
    const LANE g = LOAD(grad_y + (size_t)ray * CHANNELS + c);
    if (term_stride) of_term = (LANE)(0);
    for (int i = ray * samples; i < (ray + 1) * samples; ++i) {
      if (weight[i] < threshold) continue;
      IN REAL* row = x + (size_t)ROW(i) * INNER;
      const LANE units = preactivation(row, w + c, term + (size_t)ray * term_stride + c);
      const LANE d = units > (LANE)(0) ? weight[i] * g : (LANE)(0);
      of_term += d;
      for (int k = 0; k < INNER; ++k) grad[k] += row[k] * d;
    }
    if (term_stride) STORE(of_term, grad_term + (size_t)ray * CHANNELS + c);
  }
  if (!term_stride) STORE(of_term, grad_term + (size_t)chunk * CHANNELS + c);
  for (int k = 0; k < INNER; ++k) STORE(grad[k], partial + ((size_t)chunk * INNER + k) * CHANNELS + c);
}

#else

// The units of GROUP samples, before the ReLU.
inline void preactivate(LANE acc[GROUP][VECTORS], IN REAL* x, const int* samples, IN REAL* w, IN REAL* term) {
  EACH(v, VECTORS) EACH(r, GROUP) acc[r][v] = LOAD(term + v * LANES);
  for (int k = 0; k < INNER; ++k) {
    REAL s[GROUP];
    EACH(r, GROUP) s[r] = x[(size_t)samples[r] * INNER + k];
    EACH(v, VECTORS) {
      const LANE b = LOAD(w + k * CHANNELS + v * LANES);
      EACH(r, GROUP) acc[r][v] += s[r] * b;
    }
  }
}

// The next samples of a ray that weigh enough, at most GROUP from `*i` on; the first one stands in for those that are
// missing.
inline int pick(int picked[GROUP], IN REAL* weight, int* i, int end, REAL threshold) {
  int count = 0;
  for (; *i < end && count < GROUP; ++*i)
    if (!(weight[*i] < threshold)) picked[count++] = *i;
  for (int r = count; r < GROUP; ++r) picked[r] = picked[0];
  return count;
}

KERNEL void weighted_units(IN REAL* restrict weight, IN REAL* restrict x, IN REAL* restrict w, IN REAL* restrict term,
                           IN int* restrict rows, GLOBAL REAL* restrict y, int rays, int samples, int term_stride,
                           REAL threshold) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  LANE sum[VECTORS];
  EACH(v, VECTORS) sum[v] = (LANE)(0);
  for (int i = ray * samples; i < (ray + 1) * samples;) {
    int picked[GROUP] = {0};
    const int count = pick(picked, weight, &i, (ray + 1) * samples, threshold);
    if (count == 0) break;
    int places[GROUP];
    EACH(r, GROUP) places[r] = ROW(picked[r]);
    LANE acc[GROUP][VECTORS];
    preactivate(acc, x, places, w, term + (size_t)ray * term_stride);
    EACH(r, GROUP) {
      const REAL heaviness = r < count ? weight[picked[r]] : 0;
      EACH(v, VECTORS) sum[v] += heaviness * fmax(acc[r][v], (LANE)(0));
    }
  }
  EACH(v, VECTORS) STORE(sum[v], y + (size_t)ray * CHANNELS + v * LANES);
}

#if INNER_LANES == 1
#define INNER_LANE REAL
#else
#define INNER_LANE JOIN(REAL, INNER_LANES)
#endif

// What the staged d [count, N] give to grad_x and to this chunk's grad_w.
inline void flush(const REAL* d, const int* samples, int count, const REAL* transposed, IN REAL* x,
                  GLOBAL REAL* grad_x, GLOBAL REAL* grad_w) {
#if SAMPLE_GRADIENT
  const int tile = 8;
  for (int first = 0; first < count; first += tile)
    for (int k = 0; k < INNER; k += INNER_LANES) {
      INNER_LANE acc[8];
      EACH(i, 8) acc[i] = (INNER_LANE)(0);
      for (int c = 0; c < CHANNELS; ++c) {
        const INNER_LANE t = *(const INNER_LANE*)(transposed + c * INNER + k);
        EACH(i, 8) acc[i] += d[(first + i) * CHANNELS + c] * t;
      }
      EACH(i, 8)
      if (first + i < count) *(GLOBAL INNER_LANE*)(grad_x + (size_t)samples[first + i] * INNER + k) = acc[i];
    }
#endif
  for (int k = 0; k < INNER; k += LAYER_ROWS)
    for (int c = 0; c < CHANNELS; c += LAYER_VECTORS * LANES) {
      GLOBAL REAL* target = grad_w + k * CHANNELS + c;
      LANE acc[LAYER_ROWS][LAYER_VECTORS];
      EACH(r, LAYER_ROWS) EACH(v, LAYER_VECTORS) acc[r][v] = LOAD(target + r * CHANNELS + v * LANES);
      for (int i = 0; i < count; ++i) {
        IN REAL* s = x + (size_t)samples[i] * INNER + k;
        EACH(v, LAYER_VECTORS) {
          const LANE t = *(const LANE*)(d + i * CHANNELS + c + v * LANES);
          EACH(r, LAYER_ROWS) acc[r][v] += s[r] * t;
        }
      }
      EACH(r, LAYER_ROWS) EACH(v, LAYER_VECTORS) STORE(acc[r][v], target + r * CHANNELS + v * LANES);
    }
}

// One work-item per chunk of rays. grad_term: [R,N], or [chunks,N] when all rays share one row.
KERNEL void weighted_units_gradient(IN REAL* restrict weight, IN REAL* restrict x, IN REAL* restrict w,
                                    IN REAL* restrict term, IN int* restrict rows, IN REAL* restrict grad_y,
                                    GLOBAL REAL* restrict grad_weight, GLOBAL REAL* restrict grad_x,
                                    GLOBAL REAL* restrict grad_term, GLOBAL REAL* restrict partial, int rays,
                                    int samples, int term_stride, REAL threshold, int chunk_rays) {
  const int chunk = get_global_id(0), first = chunk * chunk_rays, end = min(first + chunk_rays, rays);
  if (first >= rays) return;
  GLOBAL REAL* grad_w = partial + (size_t)chunk * INNER * CHANNELS;
  for (int i = 0; i < INNER * CHANNELS; i += LANES) STORE((LANE)(0), grad_w + i);
  INNER_LANE transposed[CHANNELS * INNER / INNER_LANES];
#if SAMPLE_GRADIENT
  for (int i = first * samples; i < end * samples; ++i)
    if (weight[i] < threshold) {
      grad_weight[i] = 0;
      for (int k = 0; k < INNER; k += INNER_LANES)
        *(GLOBAL INNER_LANE*)(grad_x + (size_t)i * INNER + k) = (INNER_LANE)(0);
    }
  for (int c = 0; c < CHANNELS; ++c)
    for (int k = 0; k < INNER; ++k) ((REAL*)transposed)[c * INNER + k] = w[k * CHANNELS + c];
#endif
  LANE d[STAGED][VECTORS], of_term[VECTORS];
  EACH(v, VECTORS) of_term[v] = (LANE)(0);
  for (int i = 0; i < STAGED; ++i) EACH(v, VECTORS) d[i][v] = (LANE)(0);
  int staged[STAGED], count = 0;
  for (int ray = first; ray < end; ++ray) {
    IN REAL* g = grad_y + (size_t)ray * CHANNELS;
    if (term_stride) EACH(v, VECTORS) of_term[v] = (LANE)(0);
    for (int i = ray * samples; i < (ray + 1) * samples;) {
      int picked[GROUP] = {0};
      const int more = pick(picked, weight, &i, (ray + 1) * samples, threshold);
      if (more == 0) break;
      int places[GROUP];
      EACH(r, GROUP) places[r] = ROW(picked[r]);
      LANE acc[GROUP][VECTORS];
      preactivate(acc, x, places, w, term + (size_t)ray * term_stride);
      EACH(r, GROUP) if (r < more) {
        const REAL heaviness = weight[picked[r]];
        LANE dot = (LANE)(0);
        EACH(v, VECTORS) {
          const LANE grad = LOAD(g + v * LANES);
          dot += grad * fmax(acc[r][v], (LANE)(0));
          const LANE on = acc[r][v] > (LANE)(0) ? heaviness * grad : (LANE)(0);
          of_term[v] += on;
          d[count + r][v] = on;
        }
#if SAMPLE_GRADIENT
        grad_weight[picked[r]] = sum_lanes(dot);
#endif
        staged[count + r] = places[r];
      }
      count += more;
      if (count > STAGED - GROUP) {
        flush((const REAL*)d, staged, count, (const REAL*)transposed, x, grad_x, grad_w);
        count = 0;
      }
    }
    if (term_stride) EACH(v, VECTORS) STORE(of_term[v], grad_term + (size_t)ray * CHANNELS + v * LANES);
  }
  flush((const REAL*)d, staged, count, (const REAL*)transposed, x, grad_x, grad_w);
  if (!term_stride) EACH(v, VECTORS) STORE(of_term[v], grad_term + (size_t)chunk * CHANNELS + v * LANES);
}
#endif
