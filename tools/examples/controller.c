/* controller SCENE POINT POINT GAIN: the active strut of controller.cpp, in C and in one process. The C interface
 * steps the scene, so the program needs neither a daemon nor a clock. The force on the second point is -GAIN [N s/m]
 * times the speed at which the distance of the points grows, and the force on the first point is opposite. Exit codes:
 * 0 as soon as the largest speed within 1 s is at most 1 % of the largest speed within the first second; 1 if this does
 * not happen within 60 s; 2 for wrong arguments or names. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "freeflex.h"

static int complain(const char *what) {
  fprintf(stderr, "controller: %s: %s\n", what, freeflex_last_error());
  return 2;
}

/* Reads the two points, sets the forces of the strut and returns the speed at which their distance grows [m/s]. */
static double read_and_push(freeflex_motion *motion, double gain, freeflex_load *loads) {
  freeflex_point a, b;
  double line[3], length, speed = 0.0;
  int k;
  freeflex_motion_point(motion, loads[0].index, &a);
  freeflex_motion_point(motion, loads[1].index, &b);
  for (k = 0; k < 3; ++k) line[k] = b.position[k] - a.position[k];
  length = sqrt(line[0] * line[0] + line[1] * line[1] + line[2] * line[2]);
  for (k = 0; k < 3; ++k) speed += line[k] / length * (b.velocity[k] - a.velocity[k]);
  for (k = 0; k < 3; ++k) {
    loads[0].force[k] = gain * speed * line[k] / length;
    loads[1].force[k] = -loads[0].force[k];
  }
  return speed;
}

int main(int argc, char **argv) {
  freeflex_plan *plan = NULL;
  freeflex_motion *motion = NULL;
  freeflex_load loads[2] = {{FREEFLEX_POINT, 0, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}},
                            {FREEFLEX_POINT, 0, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}};
  const double gain = argc == 5 ? strtod(argv[4], NULL) : 0.0;
  double first = 0.0, largest = 0.0;
  int64_t tick, rate;
  int k;
  if (!(gain > 0.0)) return fprintf(stderr, "usage: controller SCENE POINT POINT GAIN\n"), 2;
  if (freeflex_plan_open(argv[1], NULL, NULL, &plan) != FREEFLEX_OK) return complain(argv[1]);
  for (k = 0; k < 2; ++k) {
    loads[k].index = freeflex_plan_find(plan, FREEFLEX_POINT, argv[2 + k]);
    if (loads[k].index < 0) return fprintf(stderr, "controller: the scene has no point '%s'\n", argv[2 + k]), 2;
  }
  rate = (int64_t)(freeflex_plan_rate(plan) + 0.5);
  if (freeflex_motion_new(plan, FREEFLEX_WITH_VERDICT, &motion) != FREEFLEX_OK) return complain("motion");
  freeflex_plan_free(plan); /* the motion stays valid */
  for (tick = 1; tick <= 60 * rate; ++tick) {
    const double speed = fabs(read_and_push(motion, gain, loads));
    if (speed > largest) largest = speed;
    /* the force acts for one tick; the next call replaces it */
    if (freeflex_motion_push(motion, 0, FREEFLEX_WORLD, loads, 2, 1) != FREEFLEX_OK) return complain("push");
    if (freeflex_motion_step(motion, 1) != FREEFLEX_OK) return complain("step");
    if (tick % rate != 0) continue;
    if (tick == rate) first = largest;
    if (largest <= 0.01 * first) {
      printf("speed along the line: %.6f m/s -> %.6f m/s after %.1f s\n", first, largest,
             freeflex_motion_time(motion));
      freeflex_motion_free(motion);
      return 0;
    }
    largest = 0.0;
  }
  freeflex_motion_free(motion);
  return 1;
}
