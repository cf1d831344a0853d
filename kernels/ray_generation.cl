// ray_generation: one ray per work-item.
//   pixels i32 [R] = (frame * height + row) * width + column;  centres at (column + 0.5, row + 0.5)
//   cameras [F,20] = fx fy cx cy  k1 k2 p1 p2  then camera-to-world: r r r t  r r r t  r r r t
#include "common.clh"
#define CAMERA_COLUMNS 20
#define NEWTON_STEPS 8

// Moves (x, y) to where OpenCV's distortion (k1 k2 p1 p2) gives (target_x, target_y).
inline void undistort(IN REAL* lens, REAL target_x, REAL target_y, REAL* x, REAL* y) {
  const REAL k1 = lens[0], k2 = lens[1], p1 = lens[2], p2 = lens[3];
  REAL a = target_x, b = target_y;
  for (int i = 0; i < NEWTON_STEPS; ++i) {
    const REAL r2 = a * a + b * b, radial = 1 + r2 * (k1 + r2 * k2), slope = 2 * (k1 + 2 * k2 * r2);
    const REAL error_x = a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a) - target_x;
    const REAL error_y = b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b - target_y;
    const REAL cross = slope * a * b + 2 * p1 * a + 2 * p2 * b;
    const REAL xx = radial + slope * a * a + 2 * p1 * b + 6 * p2 * a;
    const REAL yy = radial + slope * b * b + 6 * p1 * b + 2 * p2 * a;
    const REAL determinant = xx * yy - cross * cross;
    if (determinant <= (REAL)1e-6) break;  // beyond the fold of the polynomial
    a -= (yy * error_x - cross * error_y) / determinant;
    b -= (xx * error_y - cross * error_x) / determinant;
  }
  *x = a;
  *y = b;
}

KERNEL void ray_generation(IN REAL* restrict cameras, IN int* restrict pixels, GLOBAL REAL* restrict origins,
                           GLOBAL REAL* restrict directions, int capacity, int width, int height, IN int* count) {
  const int ray = get_global_id(0);
  if (ray >= live_rows(capacity, count)) return;
  const int frame = pixels[ray] / (width * height), line = pixels[ray] / width;
  const int column = pixels[ray] - line * width, row = line - frame * height;
  IN REAL* camera = cameras + frame * CAMERA_COLUMNS;
  REAL x, y;
  undistort(camera + 4, (column + (REAL)0.5 - camera[2]) / camera[0], (row + (REAL)0.5 - camera[3]) / camera[1], &x,
            &y);
  const REAL scale = 1 / sqrt(x * x + y * y + 1);
  IN REAL* pose = camera + 8;
  for (int axis = 0; axis < 3; ++axis) {
    directions[3 * ray + axis] = (pose[4 * axis] * x + pose[4 * axis + 1] * y + pose[4 * axis + 2]) * scale;
    origins[3 * ray + axis] = pose[4 * axis + 3];
  }
}
