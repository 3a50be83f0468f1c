/* freeflex in C: plans, their motion tick by tick, and what can be read from it, in this process and without
 * a bus.
 *
 *   freeflex_plan *plan;
 *   freeflex_motion *motion;
 *   if (freeflex_plan_open("boom.yaml", NULL, NULL, &plan) != FREEFLEX_OK) {
 *     puts(freeflex_last_error());
 *     return 1;
 *   }
 *   freeflex_motion_new(plan, FREEFLEX_WITH_WORD, &motion);
 *   freeflex_motion_step(motion, 1000);
 *
 * SI units. Quaternions w x y z, body axes to world axes. Indices count from 0, in the order of the scene.
 * Functions that can fail return a code below; freeflex_last_error() then says why. They leave what they were
 * given as it was, and write no result. A plan never changes and may serve any number of motions and threads.
 * A motion does one call at a time: while one thread's call is at work in it, another thread's returns
 * FREEFLEX_BUSY, or waits for its end where the function returns no code. No call may be at work in what is
 * freed. No pointer may be NULL where nothing says so. The motion is that of freeflexd and `freeflex run`, to
 * the bit.
 *
 * The binary interface is stable: no function or structure here changes, new ones are added. */
#ifndef FREEFLEX_H
#define FREEFLEX_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define FREEFLEX_API __attribute__((visibility("default")))
#else
#define FREEFLEX_API
#endif

#ifdef __cplusplus
extern "C" {
#define FREEFLEX_NOEXCEPT noexcept
#else
#define FREEFLEX_NOEXCEPT
#endif

/* Codes. */
#define FREEFLEX_OK 0
#define FREEFLEX_BAD_ARGUMENT 1 /* an index, a size or a value that the function does not take */
#define FREEFLEX_BAD_SCENE 2    /* a scene or plan with errors, or none at all */
#define FREEFLEX_NOT_FINITE 3   /* the next state would not be finite; the motion stands before it */
#define FREEFLEX_NO_MEMORY \
  4                      /* less memory than the call needs; of a set-up: or than it is estimated to need */
#define FREEFLEX_ENDED 5 /* the caller's progress function said so */
#define FREEFLEX_INTERNAL 6 /* a fault of the library */
#define FREEFLEX_BUSY 7     /* another thread's call is at work in this motion */

/* Kinds of what a plan has. */
#define FREEFLEX_POINT 0
#define FREEFLEX_LINK 1
#define FREEFLEX_GROUP 2
#define FREEFLEX_WHEEL 3
#define FREEFLEX_MODE 4 /* elastic modes, without names */

typedef struct freeflex_plan freeflex_plan;
typedef struct freeflex_motion freeflex_motion;

/* Version of the library, as "0.5.0". */
FREEFLEX_API const char *freeflex_version(void) FREEFLEX_NOEXCEPT;
/* Why the last call of this thread that failed did so; empty before any did. Valid until the next that fails.
 */
FREEFLEX_API const char *freeflex_last_error(void) FREEFLEX_NOEXCEPT;

/* ---- plans */

/* Asked while a plan is set up: what is done, its share from 0 to 1. Not 0: ends the set-up with
 * FREEFLEX_ENDED. */
typedef int (*freeflex_progress)(void *user, const char *what, double done);

/* A plan from a scene or a plan file. progress and user may be NULL. To be freed once no motion is made of it
 * any more; motions that are there keep what they need. Errors: BAD_SCENE, with every fault of the scene;
 * NO_MEMORY; ENDED. */
FREEFLEX_API int freeflex_plan_open(const char *path, freeflex_progress progress, void *user,
                                    freeflex_plan **plan) FREEFLEX_NOEXCEPT;
/* A value that is set in a scene by its path before the scene is read: service/scenes/README.md, "Values set
 * by path". All checks of a scene apply to it, and name it. */
typedef struct freeflex_setting {
  const char *path;  /* "points.hub.mass" */
  const char *value; /* YAML: "41", "[0, 0, 1]", "{ratio: 0.01}" */
} freeflex_setting;
/* As freeflex_plan_open, of a scene file with values set in it; of two for one path the later counts. count
 * 0: settings may be NULL. Errors: as freeflex_plan_open; BAD_SCENE too where a value is set in a plan file.
 */
FREEFLEX_API int freeflex_plan_open_with(const char *path, const freeflex_setting *settings, size_t count,
                                         freeflex_progress progress, void *user,
                                         freeflex_plan **plan) FREEFLEX_NOEXCEPT;
/* The same of a scene in memory, YAML or JSON. name: of the text, in messages; NULL: "<text>". folder: of the
 * files that the text names; NULL: the working folder. */
FREEFLEX_API int freeflex_plan_open_text(const char *text, const char *name, const char *folder,
                                         const freeflex_setting *settings, size_t count,
                                         freeflex_progress progress, void *user,
                                         freeflex_plan **plan) FREEFLEX_NOEXCEPT;
FREEFLEX_API void freeflex_plan_free(freeflex_plan *plan) FREEFLEX_NOEXCEPT;
/* What the set-up warns of, a line each; empty without. */
FREEFLEX_API const char *freeflex_plan_warnings(const freeflex_plan *plan) FREEFLEX_NOEXCEPT;
FREEFLEX_API const char *freeflex_plan_name(const freeflex_plan *plan) FREEFLEX_NOEXCEPT;
FREEFLEX_API uint64_t freeflex_plan_fingerprint(const freeflex_plan *plan) FREEFLEX_NOEXCEPT;
FREEFLEX_API double freeflex_plan_rate(const freeflex_plan *plan) FREEFLEX_NOEXCEPT; /* [Hz] */
FREEFLEX_API double freeflex_plan_mass(const freeflex_plan *plan) FREEFLEX_NOEXCEPT; /* [kg] */
/* How many there are of a kind; 0 of an unknown kind. */
FREEFLEX_API int32_t freeflex_plan_count(const freeflex_plan *plan, int kind) FREEFLEX_NOEXCEPT;
/* Name of one; NULL where there is none. */
FREEFLEX_API const char *freeflex_plan_name_of(const freeflex_plan *plan, int kind,
                                               int32_t index) FREEFLEX_NOEXCEPT;
/* Index by name, the first that has it; -1: none. */
FREEFLEX_API int32_t freeflex_plan_find(const freeflex_plan *plan, int kind,
                                        const char *name) FREEFLEX_NOEXCEPT;
/* [Hz] of the elastic modes, undamped. size: numbers that there is room for, at least those of FREEFLEX_MODE.
 */
FREEFLEX_API int freeflex_plan_frequencies(const freeflex_plan *plan, double *frequencies,
                                           size_t size) FREEFLEX_NOEXCEPT;
/* [m] place of each point at rest, xyz, from the centre of mass in body axes. size: at least 3 of each point.
 */
FREEFLEX_API int freeflex_plan_rest(const freeflex_plan *plan, double *rest, size_t size) FREEFLEX_NOEXCEPT;
/* [-] elastic displacement xyz of one point by each mode, body axes, mode by mode. size: at least 3 of each
 * mode. Errors: BAD_ARGUMENT of a point of which the plan keeps no rows (the scene publishes, pushes or loads
 * it nowhere). */
FREEFLEX_API int freeflex_plan_shape(const freeflex_plan *plan, int32_t point, double *shape,
                                     size_t size) FREEFLEX_NOEXCEPT;

/* ---- motion */

#define FREEFLEX_WITH_WORD 1u /* judges how far it can be trusted, at some microseconds a tick */

/* A motion at the plan's initial state. flags: 0 or the above. */
FREEFLEX_API int freeflex_motion_new(const freeflex_plan *plan, unsigned flags,
                                     freeflex_motion **motion) FREEFLEX_NOEXCEPT;
/* Another motion that stands where this one does, with its loads and its word. */
FREEFLEX_API int freeflex_motion_copy(const freeflex_motion *motion,
                                      freeflex_motion **copy) FREEFLEX_NOEXCEPT;
FREEFLEX_API void freeflex_motion_free(freeflex_motion *motion) FREEFLEX_NOEXCEPT;
/* Back to the initial state, without loads but the scene's own. The tick goes on. */
FREEFLEX_API void freeflex_motion_reset(freeflex_motion *motion) FREEFLEX_NOEXCEPT;
/* Advances by ticks >= 0. Errors: NOT_FINITE, the motion then stands at the last tick that is. */
FREEFLEX_API int freeflex_motion_step(freeflex_motion *motion, int64_t ticks) FREEFLEX_NOEXCEPT;

/* A load on a point: force [N], on one with inertia torque [N m] too; on a group: at its centre of mass and
 * about it; on a wheel: torque[0] [N m] of its motor, force zero. */
typedef struct freeflex_load {
  int32_t kind; /* FREEFLEX_POINT, FREEFLEX_GROUP or FREEFLEX_WHEEL */
  int32_t index;
  double force[3];
  double torque[3];
} freeflex_load;
#define FREEFLEX_WORLD 0
#define FREEFLEX_BODY 1
/* Puts loads into a slot, 0 to 63, in place of what is there, from the next step on; loads of all slots add.
 * axes: of the vectors. ticks: how long they act, at most commands: max_hold of the scene, 60 s by default;
 * 0: until another call takes their place. count 0: clears the slot. Errors: BAD_ARGUMENT for what a command
 * of a daemon would be refused for (messages/README.md, section 6), and for a push that finds 256 others
 * before it that wait for the next step. */
FREEFLEX_API int freeflex_motion_push(freeflex_motion *motion, int slot, int axes, const freeflex_load *loads,
                                      size_t count, int64_t ticks) FREEFLEX_NOEXCEPT;

/* ---- what can be read */

FREEFLEX_API int64_t freeflex_motion_tick(const freeflex_motion *motion) FREEFLEX_NOEXCEPT;
FREEFLEX_API double freeflex_motion_time(const freeflex_motion *motion)
    FREEFLEX_NOEXCEPT; /* [s] since the last reset */

typedef struct freeflex_frame {
  double position[3];         /* [m] centre of mass, world axes */
  double attitude[4];         /* body axes to world axes */
  double velocity[3];         /* [m/s] world axes */
  double angular_velocity[3]; /* [rad/s] body axes */
  double angular_momentum[3]; /* [kg m^2/s] about the centre of mass, world axes */
} freeflex_frame;
/* The motion at one tick: all that FREEFLEX_STATE holds of it, by one call. q [m], q_dot [m/s] as
 * freeflex_motion_elastic, momenta [N m s] as freeflex_motion_wheels; each of the three may be NULL.
 * num_modes, num_wheels: numbers that there is room for, at least those of FREEFLEX_MODE and of
 * FREEFLEX_WHEEL. */
typedef struct freeflex_state {
  int64_t tick;
  double time; /* [s] since the last reset */
  freeflex_frame frame;
} freeflex_state;
FREEFLEX_API int freeflex_motion_state(const freeflex_motion *motion, freeflex_state *state, double *q,
                                       double *q_dot, size_t num_modes, double *momenta,
                                       size_t num_wheels) FREEFLEX_NOEXCEPT;
FREEFLEX_API void freeflex_motion_frame(const freeflex_motion *motion,
                                        freeflex_frame *frame) FREEFLEX_NOEXCEPT;
/* q [m], q_dot [m/s] of each elastic mode, in the order of freeflex_plan_frequencies, either may be NULL.
 * size: numbers that there is room for in each; count, which is written even where there is too little: how
 * many are needed, may be NULL. With leave_out: {on_need: replan} the modes are all that a push may bring
 * back; until then those are zero. */
FREEFLEX_API int freeflex_motion_elastic(const freeflex_motion *motion, double *q, double *q_dot, size_t size,
                                         size_t *count) FREEFLEX_NOEXCEPT;

typedef struct freeflex_point {
  double position[3], velocity[3],
      acceleration[3];    /* [m], [m/s], [m/s^2] world axes; the last just before the tick */
  double displacement[3]; /* [m] elastic, body axes */
} freeflex_point;
/* Errors: BAD_ARGUMENT, as freeflex_plan_shape. */
FREEFLEX_API int freeflex_motion_point(const freeflex_motion *motion, int32_t point,
                                       freeflex_point *state) FREEFLEX_NOEXCEPT;
typedef struct freeflex_body {
  double attitude[4];         /* of the point, whose axes are the scene's at rest, to world axes */
  double angular_velocity[3]; /* [rad/s] axes of the point */
} freeflex_body;
/* Of a point that has inertia or an offset; any other is a BAD_ARGUMENT. */
FREEFLEX_API int freeflex_motion_body(const freeflex_motion *motion, int32_t point,
                                      freeflex_body *state) FREEFLEX_NOEXCEPT;
typedef struct freeflex_pose {
  double position[3];         /* [m] centre of mass of the group, world axes */
  double attitude[4];         /* group to world axes */
  double velocity[3];         /* [m/s] world axes */
  double angular_velocity[3]; /* [rad/s] body axes */
} freeflex_pose;
FREEFLEX_API int freeflex_motion_group(const freeflex_motion *motion, int32_t group,
                                       freeflex_pose *pose) FREEFLEX_NOEXCEPT;
/* Forces of a published link, by its kind as in messages/README.md, section 7; count, which is written even
 * where there is too little room: how many. */
FREEFLEX_API int freeflex_motion_link(const freeflex_motion *motion, int32_t link, double *values,
                                      size_t size, size_t *count) FREEFLEX_NOEXCEPT;
/* [N m s] momentum of each wheel about its axis. size: at least as many as there are. */
FREEFLEX_API int freeflex_motion_wheels(const freeflex_motion *motion, double *momenta,
                                        size_t size) FREEFLEX_NOEXCEPT;

typedef struct freeflex_energy {
  double kinetic_rigid, kinetic_elastic, potential; /* [J] */
} freeflex_energy;
FREEFLEX_API void freeflex_motion_energy(const freeflex_motion *motion,
                                         freeflex_energy *energy) FREEFLEX_NOEXCEPT;

#define FREEFLEX_GOOD 0
#define FREEFLEX_WATCH 1
#define FREEFLEX_OUTSIDE 2
typedef struct freeflex_word {
  int64_t tick;
  int32_t word; /* FREEFLEX_GOOD, FREEFLEX_WATCH or FREEFLEX_OUTSIDE */
  int32_t unused;
  double error, scale; /* [m] estimate of the error of the displacements, and what it is judged against */
  char cause[256];     /* empty when good */
} freeflex_word;
/* How far the motion can be trusted now, or the worst since the last reset. Errors: BAD_ARGUMENT of a motion
 * without a word. */
FREEFLEX_API int freeflex_motion_word(const freeflex_motion *motion, freeflex_word *word) FREEFLEX_NOEXCEPT;
FREEFLEX_API int freeflex_motion_worst_word(const freeflex_motion *motion,
                                            freeflex_word *word) FREEFLEX_NOEXCEPT;

#ifdef __cplusplus
}
#endif
#endif
