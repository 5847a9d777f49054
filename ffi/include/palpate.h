/* palpate for C and C++: soft bodies that are felt, in a host's own haptic loop or in palpate's.
 *
 * Written by cbindgen from ffi/src; docs/c.md explains it, palpate.hpp wraps it for C++17. SI units throughout. Arrays are flat:
 * three doubles for each node, in the order x, y, z. */

#ifndef PALPATE_H
#define PALPATE_H

#include <stddef.h>
#include <stdint.h>

/**
 * What a call came to. `palpate_last_error` has the text.
 */
typedef enum PalpateCode {
  /**
   * Done.
   */
  PALPATE_CODE_OK = 0,
  /**
   * A pointer that must not be null is.
   */
  PALPATE_CODE_NULL_POINTER = 1,
  /**
   * The handle is none, or what it stood for is gone: stopped, freed or used up.
   */
  PALPATE_CODE_BAD_HANDLE = 2,
  /**
   * The call is for another thread: only the one that attached itself to a session's loop may tick it.
   */
  PALPATE_CODE_WRONG_THREAD = 3,
  /**
   * The `size` of a struct is not that of this library's: it was not set, or program and library are of different versions.
   */
  PALPATE_CODE_WRONG_SIZE = 4,
  /**
   * An argument is impossible, or the call does not fit what was done before. The text says what would be right.
   */
  PALPATE_CODE_BAD_ARGUMENT = 5,
  /**
   * The scene, body or setting is unknown, impossible or inconsistent. The text names it.
   */
  PALPATE_CODE_SCENE = 6,
  /**
   * A file could not be read or written.
   */
  PALPATE_CODE_IO = 7,
  /**
   * The schedule was refused, or the system gave no thread.
   */
  PALPATE_CODE_RUNTIME = 8,
  /**
   * The device was refused.
   */
  PALPATE_CODE_DEVICE = 9,
  /**
   * The session ended by a fault of its own.
   */
  PALPATE_CODE_FAULT = 10,
  /**
   * The session has ended, as was asked for: there is nothing more to tick.
   */
  PALPATE_CODE_ENDED = 11,
  /**
   * A bug in palpate: it panicked. The text is what to report.
   */
  PALPATE_CODE_INTERNAL = 12,
} PalpateCode;

/**
 * What a contact does.
 */
typedef enum PalpateContactMode {
  /**
   * No force.
   */
  PALPATE_CONTACT_MODE_FREE = 0,
  /**
   * The contact point follows the tool.
   */
  PALPATE_CONTACT_MODE_STICK = 1,
  /**
   * The tool slides over the surface.
   */
  PALPATE_CONTACT_MODE_SLIP = 2,
  /**
   * Every node of the triangle is held: no force can be computed.
   */
  PALPATE_CONTACT_MODE_LOST = 3,
} PalpateContactMode;

/**
 * A session that is being set up. A plain number: copy it freely; once used up or freed it is recognised.
 */
typedef struct PalpateSetup {
  /**
   * The number; 0 for none.
   */
  uint64_t id;
} PalpateSetup;

/**
 * A session that runs. A plain number: copy it freely; once stopped it is recognised.
 */
typedef struct PalpateSession {
  /**
   * The number; 0 for none.
   */
  uint64_t id;
} PalpateSession;

/**
 * What a host's device can do, and where it is at the start. A 0 stands for what is not known: a weak and soft device is then taken.
 */
typedef struct PalpateDevice {
  /**
   * sizeof(PalpateDevice).
   */
  uint32_t size;
  /**
   * Leave it 0.
   */
  uint32_t reserved;
  /**
   * The name in logs and reports, of each of several; null for the only one.
   */
  const char *name;
  /**
   * Largest force that it can or may exert (N).
   */
  double max_force_n;
  /**
   * Largest torque that it can or may exert (N m); 0 if it exerts none.
   */
  double max_torque_n_m;
  /**
   * Largest stiffness that it renders without a limit cycle (N/m).
   */
  double max_stiffness_n_per_m;
  /**
   * Largest damping that it renders without a limit cycle (N s/m).
   */
  double max_damping_n_s_per_m;
  /**
   * Radius of a ball in its workspace (m).
   */
  double workspace_radius_m;
  /**
   * Where the tool is before the first tick (m), in the axes of the body.
   */
  double position_m[3];
  /**
   * How it is turned then: w, x, y, z; all 0 if it tells no orientation.
   */
  double orientation[4];
} PalpateDevice;

/**
 * What a session came to.
 */
typedef struct PalpateSummary {
  /**
   * sizeof(PalpateSummary).
   */
  uint32_t size;
  /**
   * Number of tools.
   */
  uint32_t tools;
  /**
   * Length of the run (s).
   */
  double duration_s;
  /**
   * Haptic ticks with a force, all tools together.
   */
  uint64_t ticks;
  /**
   * Local models that the global model has sent, all tools together.
   */
  uint64_t resyncs;
  /**
   * Periods without a release, all rate groups together.
   */
  uint64_t skipped;
  /**
   * Deadlines missed, all rate groups together.
   */
  uint64_t missed;
  /**
   * Largest force before the limits (N), of all tools.
   */
  double peak_force_n;
  /**
   * Largest force that a device was commanded (N), of all tools.
   */
  double peak_commanded_n;
} PalpateSummary;

/**
 * A block of springs: a lattice of nodes, each on springs to its 26 neighbours.
 */
typedef struct PalpateBlock {
  /**
   * sizeof(PalpateBlock).
   */
  uint32_t size;
  /**
   * Faces that are held: bits 0 to 5 for x_min, x_max, y_min, y_max, z_min, z_max.
   */
  uint32_t fixed_faces;
  /**
   * Nodes along x, y and z, at least 2 each and at most 1000000 in all.
   */
  uint32_t nodes[3];
  /**
   * Extent along x, y and z (m); the block lies between the origin and there.
   */
  double size_m[3];
  /**
   * Stiffness of every spring (N/m); 0 for the library's default.
   */
  double stiffness_n_per_m;
  /**
   * Damping ratio of every spring; 0 for the library's default.
   */
  double damping_ratio;
  /**
   * Mass of every node (kg); 0 for the library's default.
   */
  double node_mass_kg;
} PalpateBlock;

/**
 * A body of tetrahedra. The arrays are copied.
 */
typedef struct PalpateTetrahedra {
  /**
   * sizeof(PalpateTetrahedra).
   */
  uint32_t size;
  /**
   * Leave it 0.
   */
  uint32_t reserved;
  /**
   * Positions of the nodes (m), three numbers each.
   */
  const double *points_m;
  /**
   * Number of nodes.
   */
  size_t point_count;
  /**
   * The four nodes of each element, counted from 0.
   */
  const uint32_t *elements;
  /**
   * Number of elements.
   */
  size_t element_count;
  /**
   * Nodes that are held.
   */
  const uint32_t *fixed_nodes;
  /**
   * Number of nodes that are held; every connected part needs one.
   */
  size_t fixed_count;
  /**
   * Young's modulus (Pa); 0 for that of liver, 5000.
   */
  double young_modulus_pa;
  /**
   * Poisson's ratio, below 0.5; 0 for 0.45.
   */
  double poisson_ratio;
  /**
   * Density (kg/m^3); 0 for 1060.
   */
  double density_kg_per_m3;
  /**
   * Shear viscosity (Pa s); 0 for 2.
   */
  double viscosity_pa_s;
} PalpateTetrahedra;

/**
 * The newest tool and its forces, for a program that draws.
 */
typedef struct PalpateTool {
  /**
   * sizeof(PalpateTool).
   */
  uint32_t size;
  /**
   * State of its contact: a PalpateContactMode.
   */
  uint32_t mode;
  /**
   * Time of the run that it belongs to (s).
   */
  double time_s;
  /**
   * Where the simulated tool is (m).
   */
  double position_m[3];
  /**
   * How it is turned: w, x, y, z.
   */
  double orientation[4];
  /**
   * Force that the model computed (N): nobody feels it.
   */
  double computed_force_n[3];
  /**
   * Force that the device was commanded (N): what the hand feels.
   */
  double commanded_force_n[3];
  /**
   * Torque that the device was commanded (N m).
   */
  double commanded_torque_n_m[3];
} PalpateTool;

/**
 * A place where a tool touches the body.
 */
typedef struct PalpateContact {
  /**
   * sizeof(PalpateContact).
   */
  uint32_t size;
  /**
   * What it does: a PalpateContactMode.
   */
  uint32_t mode;
  /**
   * The triangle of the surface, by its place in `palpate_triangles`.
   */
  uint32_t triangle;
  /**
   * The tool, counted from 0.
   */
  uint32_t tool;
  /**
   * Time of the run that it belongs to (s).
   */
  double time_s;
  /**
   * Where (m).
   */
  float place_m[3];
  /**
   * Unit normal, from the surface to the tool.
   */
  float normal[3];
  /**
   * Force on the tool there (N).
   */
  float force_n[3];
} PalpateContact;

/**
 * What a device tells, once per tick.
 */
typedef struct PalpateState {
  /**
   * sizeof(PalpateState).
   */
  uint32_t size;
  /**
   * Pressed buttons, a bit each; the lowest 16 are taken.
   */
  uint32_t buttons;
  /**
   * Where the tool is (m), in the axes of the body.
   */
  double position_m[3];
  /**
   * How fast it moves (m/s).
   */
  double velocity_m_s[3];
  /**
   * The turn from the tool's own axes to those of the body: w, x, y, z, of length 1; all 0 if the device tells none.
   */
  double orientation[4];
} PalpateState;

/**
 * What a device is to exert, once per tick.
 */
typedef struct PalpateCommand {
  /**
   * sizeof(PalpateCommand).
   */
  uint32_t size;
  /**
   * 1 if this tick computed it; 0 if the period had had its release, and it is the command of before.
   */
  uint32_t is_new;
  /**
   * Force on the tool (N), after all limits.
   */
  double force_n[3];
  /**
   * Torque about the tool's centre (N m); 0 for a device that exerts none.
   */
  double torque_n_m[3];
  /**
   * Time of the run (s), at which the command was fetched.
   */
  double time_s;
} PalpateCommand;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The version of the library, such as `0.1.0`.
 */
const char *palpate_version(void);

/**
 * The text of the last call of this thread that failed; empty if none has. It is overwritten by the next that fails: copy it.
 *
 * Real-time safe.
 */
const char *palpate_last_error(void);

/**
 * The name of a code, such as `PALPATE_CODE_SCENE`.
 *
 * Real-time safe.
 */
const char *palpate_code_name(int32_t code);

/**
 * Starts a session whose haptic loop palpate owns: a thread of its own at the haptic rate, and the tool moved by the device of the
 * scene or the path of the setup. The setup is used up, also if this fails.
 *
 * # Safety
 * `session` is null or can be written.
 */
enum PalpateCode palpate_start(struct PalpateSetup setup,
                               struct PalpateSession *session);

/**
 * Starts a session whose haptic loop the host owns, for its `count` devices: the thread of that loop calls palpate_attach once and
 * then palpate_tick. Time begins with the first tick. The setup is used up, also if this fails.
 *
 * # Safety
 * `devices` is null or an array of `count` structs, each of which begins with its size and whose name is null or a text that a zero
 * byte ends; `session` is null or can be written.
 */
enum PalpateCode palpate_start_hosted(struct PalpateSetup setup,
                                      const struct PalpateDevice *devices,
                                      size_t count,
                                      struct PalpateSession *session);

/**
 * Waits for so many seconds, or until the session has ended, by itself or because another thread stops it; in virtual time, runs that
 * much of it. It keeps no other thread from the session.
 */
enum PalpateCode palpate_wait(struct PalpateSession session,
                              double seconds);

/**
 * The time since the start (s), simulated in virtual time, and whether the session has ended (1) or runs (0). Either pointer may be
 * null.
 *
 * # Safety
 * Each pointer is null or can be written.
 */
enum PalpateCode palpate_progress(struct PalpateSession session,
                                  double *time_s,
                                  int32_t *ended);

/**
 * Wants the tool at a place (m), of a session that palpate loops and whose scene has a device of the kind `pointer`.
 */
enum PalpateCode palpate_point(struct PalpateSession session,
                               double x,
                               double y,
                               double z);

/**
 * Sets the Coulomb coefficient while the session runs.
 */
enum PalpateCode palpate_set_friction(struct PalpateSession session, double coefficient);

/**
 * Sets the stiffness of the body while the session runs, in that which it was made with.
 */
enum PalpateCode palpate_set_stiffness(struct PalpateSession session, double factor);

/**
 * Sets the local model while a switchable session runs.
 *
 * # Safety
 * `model` is null or a text that a zero byte ends.
 */
enum PalpateCode palpate_set_model(struct PalpateSession session, const char *model);

/**
 * Asks a session to end: force goes to zero within the ramp of its limits. Of one that the host loops the ticks that follow do that,
 * until one gives PALPATE_CODE_ENDED. Then stop it.
 */
enum PalpateCode palpate_request_stop(struct PalpateSession session);

/**
 * Stops a session, frees it, and tells what it came to, if `summary` is not null. Gives PALPATE_CODE_FAULT, with the text, if the
 * session ended by a fault; it is stopped then too.
 *
 * On the thread that ticks it, it ends at once; from another thread it waits for the ticks that bring the force to rest. A loop that
 * does not tick any more is given up after 5 s, which is a fault.
 *
 * # Safety
 * `summary` is null or a struct that begins with its size.
 */
enum PalpateCode palpate_stop(struct PalpateSession session,
                              struct PalpateSummary *summary);

/**
 * The report of the session that this thread stopped last, several lines; empty if it has stopped none. It is overwritten by the
 * next stop: copy it.
 */
const char *palpate_report(void);

/**
 * Sets a session up from a scene file, with the paths in it relative to the file.
 *
 * # Safety
 * `path` is null or a text that a zero byte ends; `setup` is null or can be written.
 */
enum PalpateCode palpate_setup_from_file(const char *path, struct PalpateSetup *setup);

/**
 * Sets a session up from the text of a scene file. Paths in it are relative to `folder`, or to the current folder if that is null.
 *
 * # Safety
 * `toml` and `folder` are null or texts that a zero byte ends; `setup` is null or can be written.
 */
enum PalpateCode palpate_setup_from_toml(const char *toml,
                                         const char *folder,
                                         struct PalpateSetup *setup);

/**
 * Sets a session up with the built-in scene `demo`: a tool that presses a block and drags over it.
 *
 * # Safety
 * `setup` is null or can be written.
 */
enum PalpateCode palpate_setup_demo(struct PalpateSetup *setup);

/**
 * Sets a session up with a block of springs.
 *
 * # Safety
 * `block` is null or a struct that begins with its size; `setup` is null or can be written.
 */
enum PalpateCode palpate_setup_block(const struct PalpateBlock *block, struct PalpateSetup *setup);

/**
 * Sets a session up with a body of tetrahedra from arrays, which are copied.
 *
 * # Safety
 * `body` is null or a struct that begins with its size, whose pointers are null or have as many values as it says; `setup` is null
 * or can be written.
 */
enum PalpateCode palpate_setup_tetrahedra(const struct PalpateTetrahedra *body,
                                          struct PalpateSetup *setup);

/**
 * Frees a setup that is not started.
 */
enum PalpateCode palpate_setup_free(struct PalpateSetup setup);

/**
 * Sets the Coulomb coefficient; infinity for a tool that sticks until it is pulled off.
 */
enum PalpateCode palpate_setup_friction(struct PalpateSetup setup, double coefficient);

/**
 * Names the local model: `auto`, `full`, `hold`, `patch`, `linear_boundary`, `scaled_boundary`, `condensed`, `predicted` or
 * `predictive`.
 *
 * # Safety
 * `model` is null or a text that a zero byte ends.
 */
enum PalpateCode palpate_setup_model(struct PalpateSetup setup,
                                     const char *model);

/**
 * Gives the tool the shape of a sphere of this radius (m); without, it is a point.
 */
enum PalpateCode palpate_setup_sphere(struct PalpateSetup setup, double radius_m);

/**
 * Sets the rates of the two models (Hz), 1000 and 30 without.
 */
enum PalpateCode palpate_setup_rates(struct PalpateSetup setup, double haptic_hz, double global_hz);

/**
 * Lets the session end by itself after so many seconds. Without, a session of a scene that palpate loops runs as long as the scene
 * says, and all others until they are stopped.
 */
enum PalpateCode palpate_setup_duration(struct PalpateSetup setup,
                                        double seconds);

/**
 * Writes a log to `path`, overwriting what is there.
 *
 * # Safety
 * `path` is null or a text that a zero byte ends.
 */
enum PalpateCode palpate_setup_log(struct PalpateSetup setup, const char *path);

/**
 * Moves the tool of a session that palpate loops along a path: at `times_s` (s, increasing) it is at `positions_m` (m, three numbers
 * each), in between on straight lines.
 *
 * # Safety
 * The pointers are null or have `count` times and three times as many positions.
 */
enum PalpateCode palpate_setup_path(struct PalpateSetup setup,
                                    const double *times_s,
                                    const double *positions_m,
                                    size_t count);

/**
 * Runs in virtual time: bit-identical every time, as fast as the machine allows, on the thread that waits or ticks. A tick is then
 * one haptic period, and not real-time safe.
 */
enum PalpateCode palpate_setup_virtual_time(struct PalpateSetup setup);

/**
 * Lets the local model be changed while the session runs, by palpate_set_model.
 */
enum PalpateCode palpate_setup_switchable(struct PalpateSetup setup);

/**
 * Lets palpate_contacts tell where the tools touch.
 */
enum PalpateCode palpate_setup_share_contacts(struct PalpateSetup setup);

/**
 * The numbers of nodes and of triangles of the surface; they never change. Nodes inside the body are counted too.
 *
 * # Safety
 * The pointers are null or can be written.
 */
enum PalpateCode palpate_surface_size(struct PalpateSession session,
                                      size_t *nodes,
                                      size_t *triangles);

/**
 * The nodes of the surface's triangles, three numbers each, counter-clockwise seen from outside; they never change. `room` is the
 * number of triangles that there is room for.
 *
 * # Safety
 * `triangles` is null or has room for three times `room` numbers.
 */
enum PalpateCode palpate_triangles(struct PalpateSession session,
                                   uint32_t *triangles,
                                   size_t room);

/**
 * The newest positions of all nodes (m), three numbers each, and the time (s) that they belong to, if `time_s` is not null; they
 * come at the rate of the global model. `room` is the number of nodes that there is room for.
 *
 * # Safety
 * `positions_m` is null or has room for three times `room` numbers; `time_s` is null or can be written.
 */
enum PalpateCode palpate_surface(struct PalpateSession session,
                                 double *positions_m,
                                 size_t room,
                                 double *time_s);

/**
 * The newest tool, counted from 0, and its forces; they come at the haptic rate.
 *
 * # Safety
 * `tool` is null or a struct that begins with its size.
 */
enum PalpateCode palpate_tool(struct PalpateSession session, uint32_t index, struct PalpateTool *tool);

/**
 * The places where tools touch, in the newest tick that is known: 0.1 to 0.15 s old, and up to 1.05 s while a part of the session takes
 * that long for one release. Their number is put at `count`, also if it is more than there is `room` for, which is a failure. Of a
 * session that was set up with palpate_setup_share_contacts.
 *
 * # Safety
 * `contacts` is null or has room for `room` structs; `count` is null or can be written.
 */
enum PalpateCode palpate_contacts(struct PalpateSession session,
                                  struct PalpateContact *contacts,
                                  size_t room,
                                  size_t *count);

/**
 * Makes the calling thread the one that ticks a session which was started with palpate_start_hosted, and readies it: touches the
 * stack that a tick may need. Policy, priority and core of the thread are the host's affair.
 *
 * Not real-time safe: call it before the loop. A thread that ends, ends its sessions.
 */
enum PalpateCode palpate_attach(struct PalpateSession session);

/**
 * One haptic tick of a session with one device: takes what the device tells and gives what it is to exert.
 *
 * The local model is computed in this call, on this thread: the force belongs to this state, with no tick of delay. The global model
 * and the log run on threads of palpate's. The first tick is time zero of the run and gives no force. After that, each call runs the
 * release of the period that it falls in, at the haptic rate of the session; a call in a period that has had its release gives the
 * command of before, with `is_new` 0, so a loop may be faster; of a slower one the periods between are made up, eight a tick at most.
 *
 * Real-time safe: no allocation, no lock, no system call, no callback, nothing unwinds. Exceptions: in virtual time, and in the tick
 * that ends the session, which is the one that gives PALPATE_CODE_ENDED. Only on the thread that attached itself.
 *
 * Whenever it gives anything but PALPATE_CODE_OK, exert nothing.
 *
 * # Safety
 * `state` and `command` are null or structs that begin with their size.
 */
enum PalpateCode palpate_tick(struct PalpateSession session,
                              const struct PalpateState *state,
                              struct PalpateCommand *command);

/**
 * One haptic tick of a session with several devices, in the order in which they were given: see palpate_tick.
 *
 * # Safety
 * `states` and `commands` are null or arrays of `count` structs, each of which begins with its size.
 */
enum PalpateCode palpate_tick_all(struct PalpateSession session,
                                  const struct PalpateState *states,
                                  struct PalpateCommand *commands,
                                  size_t count);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* PALPATE_H */
