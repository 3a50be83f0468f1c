/* freeflex in C: loads plans, advances their motion tick by tick and reads its quantities, in this process
 * and without a bus.
 *
 *   freeflex_plan *plan;
 *   freeflex_motion *motion;
 *   if (freeflex_plan_open("boom.yaml", NULL, NULL, &plan) != FREEFLEX_OK) {
 *     puts(freeflex_last_error());
 *     return 1;
 *   }
 *   freeflex_motion_new(plan, FREEFLEX_WITH_VERDICT, &motion);
 *   freeflex_motion_step(motion, 1000);
 *
 * SI units. Quaternions w x y z, body axes to world axes. Indices count from 0, in the order of the scene.
 * Functions that can fail return one of the codes below; freeflex_last_error() then returns the reason. After
 * an error their arguments are unchanged and no result is written. A plan never changes; any number of
 * motions and threads may use it. A motion executes one call at a time: while a call of one thread is active
 * in a motion, a call of another thread returns FREEFLEX_BUSY, or waits if the function returns no code. An
 * object must not be freed while a call uses it. Pointers must not be NULL unless the comment allows it. The
 * motion is bit for bit the motion that freeflexd and `freeflex run` compute.
 *
 * The binary interface is stable: no function or structure here changes; new ones may be added. */
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
#define FREEFLEX_BAD_ARGUMENT 1 /* an index, a size or a value that the function does not allow */
#define FREEFLEX_BAD_SCENE 2    /* the scene or plan has errors or cannot be read */
#define FREEFLEX_NOT_FINITE 3   /* the next state would not be finite; the motion stays before it */
#define FREEFLEX_NO_MEMORY \
  4                      /* too little memory for the call, or less than a set-up is estimated to need */
#define FREEFLEX_ENDED 5 /* ended by the caller's progress function */
#define FREEFLEX_INTERNAL 6 /* an error in the library */
#define FREEFLEX_BUSY 7     /* a call of another thread is active in this motion */

/* Kinds of items in a plan. */
#define FREEFLEX_POINT 0
#define FREEFLEX_LINK 1
#define FREEFLEX_GROUP 2
#define FREEFLEX_WHEEL 3
#define FREEFLEX_MODE 4 /* elastic modes, which have no names */

typedef struct freeflex_plan freeflex_plan;
typedef struct freeflex_motion freeflex_motion;

/* Returns the version of the library, as "0.5.0". */
FREEFLEX_API const char *freeflex_version(void) FREEFLEX_NOEXCEPT;
/* Returns the reason of the last failed call of this thread; empty if no call has failed. Valid until the
 * next failure. */
FREEFLEX_API const char *freeflex_last_error(void) FREEFLEX_NOEXCEPT;

/* ---- plans */

/* Function of the caller that is called while a plan is set up, with the present stage and the finished
 * fraction of the stage, 0 to 1. If it returns a value other than 0, the set-up ends with FREEFLEX_ENDED. */
typedef int (*freeflex_progress)(void *user, const char *what, double done);

/* Makes a plan from a scene or a plan file. progress and user may be NULL. The plan may be freed while
 * motions made from it exist. Errors: BAD_SCENE, with every fault of the scene; NO_MEMORY; ENDED. */
FREEFLEX_API int freeflex_plan_open(const char *path, freeflex_progress progress, void *user,
                                    freeflex_plan **plan) FREEFLEX_NOEXCEPT;
/* A value that is set in a scene by its path before the scene is read: service/scenes/README.md, "Values set
 * by path". All checks of a scene apply to the value, and their messages contain its path. */
typedef struct freeflex_setting {
  const char *path;  /* "points.hub.mass" */
  const char *value; /* YAML: "41", "[0, 0, 1]", "{ratio: 0.01}" */
} freeflex_setting;
/* Makes a plan from a scene file in which values are set. If two settings have the same path, the later one
 * is used. If count is 0, settings may be NULL. Errors: as freeflex_plan_open; also BAD_SCENE if a value is set
 * in a plan file. */
FREEFLEX_API int freeflex_plan_open_with(const char *path, const freeflex_setting *settings, size_t count,
                                         freeflex_progress progress, void *user,
                                         freeflex_plan **plan) FREEFLEX_NOEXCEPT;
/* Makes a plan from a scene in memory, YAML or JSON. name: stands for the text in messages; NULL: "<text>".
 * folder: contains the files that the text refers to; NULL: the working folder. */
FREEFLEX_API int freeflex_plan_open_text(const char *text, const char *name, const char *folder,
                                         const freeflex_setting *settings, size_t count,
                                         freeflex_progress progress, void *user,
                                         freeflex_plan **plan) FREEFLEX_NOEXCEPT;
FREEFLEX_API void freeflex_plan_free(freeflex_plan *plan) FREEFLEX_NOEXCEPT;
/* Returns the warnings of the set-up, one per line; empty if there are none. */
FREEFLEX_API const char *freeflex_plan_warnings(const freeflex_plan *plan) FREEFLEX_NOEXCEPT;
FREEFLEX_API const char *freeflex_plan_name(const freeflex_plan *plan) FREEFLEX_NOEXCEPT;
FREEFLEX_API uint64_t freeflex_plan_fingerprint(const freeflex_plan *plan) FREEFLEX_NOEXCEPT;
FREEFLEX_API double freeflex_plan_rate(const freeflex_plan *plan) FREEFLEX_NOEXCEPT; /* [Hz] */
FREEFLEX_API double freeflex_plan_mass(const freeflex_plan *plan) FREEFLEX_NOEXCEPT; /* [kg] */
/* Returns the number of items of a kind; 0 for an unknown kind. */
FREEFLEX_API int32_t freeflex_plan_count(const freeflex_plan *plan, int kind) FREEFLEX_NOEXCEPT;
/* Returns the name of an item; NULL if there is no such item or it has no name. */
FREEFLEX_API const char *freeflex_plan_name_of(const freeflex_plan *plan, int kind,
                                               int32_t index) FREEFLEX_NOEXCEPT;
/* Returns the index of the first item with this name; -1 if there is none. */
FREEFLEX_API int32_t freeflex_plan_find(const freeflex_plan *plan, int kind,
                                        const char *name) FREEFLEX_NOEXCEPT;
/* Writes the undamped frequencies of the elastic modes [Hz]. size: length of the array, at least the count of
 * FREEFLEX_MODE. */
FREEFLEX_API int freeflex_plan_frequencies(const freeflex_plan *plan, double *frequencies,
                                           size_t size) FREEFLEX_NOEXCEPT;
/* Writes the rest position of each point, xyz, from the centre of mass in body axes [m]. size: at least 3
 * numbers for each point. */
FREEFLEX_API int freeflex_plan_rest(const freeflex_plan *plan, double *rest, size_t size) FREEFLEX_NOEXCEPT;
/* Writes the mode shapes at one point, mode by mode: the elastic displacement xyz in body axes [-]. size: at
 * least 3 numbers for each mode. Errors: BAD_ARGUMENT if the plan does not store the mode shapes at the
 * point, because the scene does not publish, push or load it. */
FREEFLEX_API int freeflex_plan_shape(const freeflex_plan *plan, int32_t point, double *shape,
                                     size_t size) FREEFLEX_NOEXCEPT;

/* ---- motion */

#define FREEFLEX_WITH_VERDICT 1u /* computes verdicts on the accuracy; freeflex plan says in what time */

/* Makes a motion that begins at the plan's initial state. flags: 0 or FREEFLEX_WITH_VERDICT. */
FREEFLEX_API int freeflex_motion_new(const freeflex_plan *plan, unsigned flags,
                                     freeflex_motion **motion) FREEFLEX_NOEXCEPT;
/* Makes a copy of a motion with its state, loads and verdicts. */
FREEFLEX_API int freeflex_motion_copy(const freeflex_motion *motion,
                                      freeflex_motion **copy) FREEFLEX_NOEXCEPT;
FREEFLEX_API void freeflex_motion_free(freeflex_motion *motion) FREEFLEX_NOEXCEPT;
/* Sets the motion back to the initial state and removes all pushes; the loads of the scene stay. The count of
 * ticks continues. */
FREEFLEX_API void freeflex_motion_reset(freeflex_motion *motion) FREEFLEX_NOEXCEPT;
/* Advances by ticks >= 0. Errors: NOT_FINITE; the motion then stays at the last tick with a finite state. */
FREEFLEX_API int freeflex_motion_step(freeflex_motion *motion, int64_t ticks) FREEFLEX_NOEXCEPT;

/* A load. On a point: force [N], and torque [N m] if the point has inertia. On a group: force at the group's
 * centre of mass and torque about it. On a wheel: torque[0] [N m] of its motor, all else zero. */
typedef struct freeflex_load {
  int32_t kind; /* FREEFLEX_POINT, FREEFLEX_GROUP or FREEFLEX_WHEEL */
  int32_t index;
  double force[3];
  double torque[3];
} freeflex_load;
#define FREEFLEX_WORLD 0
#define FREEFLEX_BODY 1
/* Replaces the loads of a slot, 0 to 63, from the next step on; the loads of all slots add up. axes: the axes
 * of the vectors. ticks: how long the loads act, at most `commands: max_hold` of the scene, 60 s by default;
 * 0: until another call replaces them. If count is 0, the slot is cleared. Errors: BAD_ARGUMENT if a daemon
 * would reject the loads (messages/README.md, section 6), or if 256 pushes already wait for the next step. */
FREEFLEX_API int freeflex_motion_push(freeflex_motion *motion, int slot, int axes, const freeflex_load *loads,
                                      size_t count, int64_t ticks) FREEFLEX_NOEXCEPT;

/* ---- reading a motion */

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
/* The motion at one tick. freeflex_motion_state reads all contents of FREEFLEX_STATE in one call: q [m] and
 * q_dot [m/s] as freeflex_motion_elastic does, momenta [N m s] as freeflex_motion_wheels does. Each of these
 * three arrays may be NULL. num_modes, num_wheels: lengths of the arrays, at least the counts of
 * FREEFLEX_MODE and FREEFLEX_WHEEL. */
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
/* Writes q [m] and q_dot [m/s] of each elastic mode, in the order of freeflex_plan_frequencies; either may be
 * NULL. size: length of each array. count: receives the needed length, even if size is too small; may be
 * NULL. If the scene has `leave_out: {on_need: replan}`, the modes are those of the fallback plan; modes that
 * the plan omits are zero until a push needs them. */
FREEFLEX_API int freeflex_motion_elastic(const freeflex_motion *motion, double *q, double *q_dot, size_t size,
                                         size_t *count) FREEFLEX_NOEXCEPT;

typedef struct freeflex_point {
  double position[3], velocity[3],
      acceleration[3];    /* [m], [m/s], [m/s^2] world axes; acceleration just before the tick */
  double displacement[3]; /* [m] elastic, body axes */
} freeflex_point;
/* Reads a point. Errors: BAD_ARGUMENT under the condition of freeflex_plan_shape. */
FREEFLEX_API int freeflex_motion_point(const freeflex_motion *motion, int32_t point,
                                       freeflex_point *state) FREEFLEX_NOEXCEPT;
/* In the undeformed scene, the axes of the point are the axes of the scene. */
typedef struct freeflex_body {
  double attitude[4];         /* axes of the point to world axes */
  double angular_velocity[3]; /* [rad/s] axes of the point */
} freeflex_body;
/* Reads the attitude of a point that has inertia or an offset. Errors: BAD_ARGUMENT for any other point. */
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
/* Writes the forces of a published link; messages/README.md, section 7, lists them for each kind of link.
 * count: receives the needed length, even if size is too small. */
FREEFLEX_API int freeflex_motion_link(const freeflex_motion *motion, int32_t link, double *values,
                                      size_t size, size_t *count) FREEFLEX_NOEXCEPT;
/* Writes the momentum of each wheel about its axis [N m s]. size: at least the count of FREEFLEX_WHEEL. */
FREEFLEX_API int freeflex_motion_wheels(const freeflex_motion *motion, double *momenta,
                                        size_t size) FREEFLEX_NOEXCEPT;

typedef struct freeflex_energy {
  double kinetic_rigid, kinetic_elastic, potential; /* [J] */
} freeflex_energy;
FREEFLEX_API void freeflex_motion_energy(const freeflex_motion *motion,
                                         freeflex_energy *energy) FREEFLEX_NOEXCEPT;

#define FREEFLEX_NOT_JUDGED (-1)
#define FREEFLEX_GOOD 0
#define FREEFLEX_WATCH 1
#define FREEFLEX_OUTSIDE 2
typedef struct freeflex_verdict {
  int64_t tick;
  int32_t level; /* FREEFLEX_NOT_JUDGED, FREEFLEX_GOOD, FREEFLEX_WATCH or FREEFLEX_OUTSIDE */
  int32_t unused;
  double error, scale; /* [m] estimated error of the displacements, and the scale it is compared with */
  char cause[256];     /* empty if good */
} freeflex_verdict;
/* Read the present verdict on the motion's accuracy, and the worst since the last reset. Errors: BAD_ARGUMENT
 * for a motion made without FREEFLEX_WITH_VERDICT. */
FREEFLEX_API int freeflex_motion_verdict(const freeflex_motion *motion,
                                         freeflex_verdict *verdict) FREEFLEX_NOEXCEPT;
FREEFLEX_API int freeflex_motion_worst_verdict(const freeflex_motion *motion,
                                                  freeflex_verdict *verdict) FREEFLEX_NOEXCEPT;

/* The estimated errors of a motion at the last tick that was judged. */
typedef struct freeflex_errors {
  int64_t tick;       /* -1: nothing is judged */
  double position;    /* [m] of the centre of mass */
  double attitude;    /* [rad] */
  double deformation; /* [m] of the elastic displacements, root mean square over the mass */
  double shadow;      /* [m] by how much the motion with which this one is compared may itself be wrong */
} freeflex_errors;
/* Reads the estimated errors. Errors: BAD_ARGUMENT for a motion made without FREEFLEX_WITH_VERDICT. */
FREEFLEX_API int freeflex_motion_errors(const freeflex_motion *motion,
                                        freeflex_errors *errors) FREEFLEX_NOEXCEPT;

/* One effect that a motion lacks: its name, the largest distance from the same motion with this effect, and
 * what to do about it. The distance is infinite if the motion with this effect stops. */
typedef struct freeflex_effect {
  char name[64];
  double deformation, attitude, position; /* [m], [rad], [m] */
  char remedy[128];
} freeflex_effect;
/* Runs a scene without commands for a time [s], beside better plans of it, and writes the effects that its
 * motion lacks, the largest first. path: scene file; NULL: the scene is `text`, see freeflex_plan_open_text.
 * num_effects receives the number written, at most size. Takes some ten times as long as the motion. Errors:
 * BAD_SCENE; BAD_ARGUMENT if nothing judges the motion; NOT_FINITE. */
FREEFLEX_API int freeflex_explain(const char *path, const char *text, const char *folder,
                                  const freeflex_setting *settings, size_t count, double seconds,
                                  freeflex_effect *effects, size_t size,
                                  size_t *num_effects) FREEFLEX_NOEXCEPT;

/* ---- campaigns: many cases of a scene (service/campaign/README.md) */

typedef struct freeflex_campaign freeflex_campaign;
/* Reads a campaign file, but not its scene. Errors: BAD_SCENE, with every fault. */
FREEFLEX_API int freeflex_campaign_open(const char *path, freeflex_campaign **campaign) FREEFLEX_NOEXCEPT;
FREEFLEX_API void freeflex_campaign_free(freeflex_campaign *campaign) FREEFLEX_NOEXCEPT;
/* Returns the number of cases. */
FREEFLEX_API int64_t freeflex_campaign_cases(const freeflex_campaign *campaign) FREEFLEX_NOEXCEPT;

typedef struct freeflex_parameter {
  const char *name;
  double value;
} freeflex_parameter;
/* What a controller is told of its case. The pointers are valid until the case ends. */
typedef struct freeflex_case {
  int64_t number;
  uint64_t seed; /* for freeflex_random_normal; differs from case to case */
  const freeflex_parameter *parameters; /* of the controller */
  size_t num_parameters;
} freeflex_case;
#define FREEFLEX_REASON_SIZE 256
/* A controller of cases. begin and end may be NULL. begin stores in `self` what the other functions get. act is
 * called at each tick that is a multiple of `controller: every` of the campaign; it reads the motion and pushes
 * loads. It must not step, reset or free the motion. A function that returns a value other than 0 ends the case,
 * with the text that it wrote to `reason`. end is called after each begin. */
typedef struct freeflex_controller {
  int (*begin)(const freeflex_plan *plan, const freeflex_case *of, void **self, char *reason);
  int (*act)(void *self, freeflex_motion *motion, char *reason);
  void (*end)(void *self);
} freeflex_controller;
/* A library that a campaign names under `controller: library` exports these three functions under the names
 * freeflex_controller_begin, freeflex_controller_act and freeflex_controller_end. */

/* Runs a case.
 * values: text of each variable, in the order of the campaign; NULL: those that are drawn.
 * controller: NULL only if the campaign names none.
 * row: receives the row of the table, valid until the next call for this campaign.
 * seconds: receives the wall clock times of the set-up and of the run [s]; may be NULL.
 * Errors: BAD_ARGUMENT if there is no such case, or if the campaign has a controller or commands that are not
 * given here. A case that fails is no error: its row says why. */
FREEFLEX_API int freeflex_campaign_run(freeflex_campaign *campaign, int64_t number, const char *const *values,
                                       const freeflex_controller *controller, const char **row,
                                       double seconds[2]) FREEFLEX_NOEXCEPT;
/* Runs a case on another scene file, which has the case's values, and writes the commands of the controller to a
 * log that `freeflex run --log` reads. Errors: as freeflex_campaign_run; INTERNAL if the log cannot be written. */
FREEFLEX_API int freeflex_campaign_trace(freeflex_campaign *campaign, int64_t number, const char *scene,
                                         const freeflex_controller *controller, const char *log,
                                         const char **row) FREEFLEX_NOEXCEPT;
/* Returns the number of variables. */
FREEFLEX_API int32_t freeflex_campaign_variables(const freeflex_campaign *campaign) FREEFLEX_NOEXCEPT;

/* Returns a random number of the standard normal distribution. It depends only on the three arguments, and is the
 * same on every machine: for the noise of a sensor, take the seed of the case, the number of the sensor and the
 * number of the sample. */
FREEFLEX_API double freeflex_random_normal(uint64_t seed, uint64_t stream, uint64_t index) FREEFLEX_NOEXCEPT;

#ifdef __cplusplus
}
#endif
#endif
