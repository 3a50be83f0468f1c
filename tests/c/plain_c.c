/* Uses the C interface from C: opens a scene, pushes, steps, and prints the figures that c_interface_test compares.
 *   plain_c SCENE POINT TICKS */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "freeflex.h"

static int complain(const char *what) {
  fprintf(stderr, "plain_c: %s: %s\n", what, freeflex_last_error());
  return 2;
}

int main(int argc, char **argv) {
  freeflex_plan *plan = NULL;
  freeflex_motion *motion = NULL;
  freeflex_load load = {FREEFLEX_POINT, 0, {0.0, 0.0, 10.0}, {0.0, 0.0, 0.0}};
  freeflex_frame frame;
  freeflex_point point;
  if (argc != 4) return 2;
  if (freeflex_plan_open(argv[1], NULL, NULL, &plan) != FREEFLEX_OK) return complain("open");
  load.index = freeflex_plan_find(plan, FREEFLEX_POINT, argv[2]);
  if (freeflex_motion_new(plan, FREEFLEX_WITH_VERDICT, &motion) != FREEFLEX_OK) return complain("new");
  freeflex_plan_free(plan); /* the motion stays valid */
  if (freeflex_motion_push(motion, 0, FREEFLEX_WORLD, &load, 1, 50) != FREEFLEX_OK) return complain("push");
  if (freeflex_motion_step(motion, strtoll(argv[3], NULL, 10)) != FREEFLEX_OK) return complain("step");
  if (freeflex_motion_point(motion, load.index, &point) != FREEFLEX_OK) return complain("point");
  freeflex_motion_frame(motion, &frame);
  printf("%" PRId64 " %.17g %.17g %.17g %.17g\n", freeflex_motion_tick(motion), frame.position[2],
         frame.attitude[0], point.position[2], point.velocity[2]);
  freeflex_motion_free(motion);
  return 0;
}
