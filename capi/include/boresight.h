/* boresight for C: trackers for manoeuvring targets in clutter.
 *
 * The caller owns all memory, aligned to BORESIGHT_ALIGN; nothing is allocated, nothing global is written. Calls for different
 * trackers may run at the same time, calls for one tracker may not. SI units, radians, single precision.
 *
 * Made from the sources by `cargo run -p headers`; ./ci.sh checks that it is current. */

#ifndef BORESIGHT_H
#define BORESIGHT_H

#include <stddef.h>
#include <stdint.h>

// Bytes of a `boresight_turning_ra`
#define BORESIGHT_TURNING_RA_SIZE 17536

// Bytes of a `boresight_turning_rar`
#define BORESIGHT_TURNING_RAR_SIZE 18328

// Bytes of a `boresight_accelerating_ra`
#define BORESIGHT_ACCELERATING_RA_SIZE 21840

// Bytes of a `boresight_accelerating_rar`
#define BORESIGHT_ACCELERATING_RAR_SIZE 22632

// Bytes of what a log begins with
#define BORESIGHT_LOG_HEADER 196

// Bytes of the largest record of a log
#define BORESIGHT_LOG_RECORD 2256

// Most components of a measurement
#define BORESIGHT_COMPONENTS 4

// Most states of a target
#define BORESIGHT_STATES 9

// Most entries of the upper triangle of a covariance
#define BORESIGHT_COVARIANCE 45

// Most modes
#define BORESIGHT_MODES 8

// Alignment of a tracker's memory [bytes]
#define BORESIGHT_ALIGN 8

// In `given` of a detection: `sigma` is this detection's own, not the radar's
#define BORESIGHT_SIGMA 1

// In `given` of a detection: `amplitude` says how strong it is
#define BORESIGHT_AMPLITUDE 2

// What came of a call. Anything but BORESIGHT_STATUS_OK has changed nothing.
enum boresight_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Done
  BORESIGHT_STATUS_OK = 0,
  // A pointer that must not be is NULL
  BORESIGHT_STATUS_NULL = 1,
  // The memory is too small or not aligned
  BORESIGHT_STATUS_MEMORY = 2,
  // This is no tracker: it has not been created, or was overwritten
  BORESIGHT_STATUS_NO_TRACKER = 3,
  // No track has this identity
  BORESIGHT_STATUS_NO_TRACK = 4,
  // More detections than memory can hold
  BORESIGHT_STATUS_COUNT = 5,
  // No scan without a record: none has been offered yet, or the last one has its record
  BORESIGHT_STATUS_NO_SCAN = 6,
  // Configuration: a number is not finite
  BORESIGHT_STATUS_CONFIG_NOT_FINITE = 16,
  // Configuration: a number that must be positive is not
  BORESIGHT_STATUS_CONFIG_NOT_POSITIVE = 17,
  // Configuration: a probability lies outside 0 to 1
  BORESIGHT_STATUS_CONFIG_NOT_A_PROBABILITY = 18,
  // Configuration: probabilities do not sum to one
  BORESIGHT_STATUS_CONFIG_NOT_NORMALISED = 19,
  // Configuration: a covariance is not positive definite
  BORESIGHT_STATUS_CONFIG_NOT_DEFINITE = 20,
  // Configuration: hits and window need 1 <= hits <= window <= 32 and 1 <= misses <= 32
  BORESIGHT_STATUS_CONFIG_BAD_WINDOW = 21,
  // Configuration: wrong in another way
  BORESIGHT_STATUS_CONFIG_OTHER = 31,
  // Scan: older than the last one
  BORESIGHT_STATUS_SCAN_TIME_REVERSED = 32,
  // Scan: a detection is not finite
  BORESIGHT_STATUS_SCAN_DETECTION_NOT_FINITE = 33,
  // Scan: the noise of a detection is not positive definite
  BORESIGHT_STATUS_SCAN_NOISE_NOT_DEFINITE = 34,
  // Scan: a detection is more than a minute from its scan
  BORESIGHT_STATUS_SCAN_OFFSET_TOO_LARGE = 35,
  // Scan: the place or motion of the radar is not finite
  BORESIGHT_STATUS_SCAN_SENSOR_NOT_FINITE = 36,
  // Scan: wrong in another way
  BORESIGHT_STATUS_SCAN_OTHER = 47,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum boresight_status boresight_status;
#else
typedef uint32_t boresight_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// How far a track is trusted.
enum boresight_trust
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Started, not yet seen often enough
  BORESIGHT_TRUST_TENTATIVE = 0,
  // Seen often enough, and in its last scan
  BORESIGHT_TRUST_CONFIRMED = 1,
  // Confirmed before, not seen in its last scan
  BORESIGHT_TRUST_COASTING = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum boresight_trust boresight_trust;
#else
typedef uint32_t boresight_trust;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// One configuration: how large its trackers are, how they are made and found. C knows it by address only.
typedef struct boresight_kind boresight_kind;

// A tracker in the caller's memory, which C knows by address only.
typedef struct boresight_tracker boresight_tracker;

// All numbers of a ready configuration. SI units, radians.
typedef struct {
  // Where the radar is: x, y, z [m]
  float position[3];
  // How it moves over the ground [m/s]
  float velocity[3];
  // How it is turned: yaw (left), pitch (nose down), roll (right side down) [rad]
  float attitude[3];
  // Standard deviation of the range [m]
  float sigma_range;
  // Standard deviation of the azimuth [rad]
  float sigma_azimuth;
  // Standard deviation of the range-rate [m/s]; unused by radars without
  float sigma_range_rate;
  // V where range-rate is known modulo 2 V [m/s]; 0 where it is not folded
  float unambiguous_speed;
  // Probability of detection
  float p_detect;
  // Expected false detections per scan and unit of measurement volume, such as 1/(m rad); 0 where unknown: it is estimated
  float clutter_density;
  // Gate: the largest normalised innovation squared
  float gate;
  // Variance of the random acceleration of every mode, as one value a step [(m/s²)²]
  float mode_noise[3];
  // Rate of the turning modes [rad/s]; unused by accelerating ones
  float turn_rate;
  // Probability of a jump from mode (row) to mode (column) between two scans
  float jump[3][3];
  // Mode probabilities of a new track
  float initial[3];
  // A track is confirmed by so many hits ..
  uint32_t hits;
  // .. in so many scans, at most 32
  uint32_t window;
  // It is deleted after so many misses in a row, at most 32
  uint32_t misses;
  // It is deleted where its position has a larger standard deviation [m]; 0 for no limit
  float position_limit;
  // It is deleted as a duplicate nearer than so many standard deviations to an older one; 0 never
  float duplicate_distance;
  // The largest speed of a target: what may pair two detections [m/s]
  float max_speed;
  // How long a detection waits for its partner [µs]
  uint32_t max_gap_us;
  // Standard deviation of the speed of new tracks, an axis [m/s]
  float sigma_speed;
  // Standard deviation of the acceleration of new tracks, an axis [m/s²]; unused by turning modes
  float sigma_acceleration;
} boresight_parameters;

// One plot. All zero but `z`: made at the time of the scan, with the noise of the radar.
typedef struct {
  // The measurement, in the order of the configuration's components [m, rad, m/s]
  float z[BORESIGHT_COMPONENTS];
  // Standard deviations of the components, where given
  float sigma[BORESIGHT_COMPONENTS];
  // Strength, where given: decides what is kept of a scan that is too large
  float amplitude;
  // How long after the time of its scan it was made [µs], at most a minute either way
  int32_t offset_us;
  // BORESIGHT_SIGMA, BORESIGHT_AMPLITUDE, both or none
  uint32_t given;
} boresight_detection;

// What a scan did, and what was given up for want of room.
typedef struct {
  // Detections taken in
  uint16_t detections;
  // Detections beyond the capacity, given up by amplitude or by arrival
  uint16_t detections_dropped;
  // Detections that no track gated
  uint16_t detections_unclaimed;
  // Detections that could have become half of a track, forgotten for want of room
  uint16_t seeds_dropped;
  // Tracks started
  uint16_t births;
  // Tracks not started for want of a slot
  uint16_t births_refused;
  // Tentative tracks that gave their slot to a birth
  uint16_t tracks_evicted;
  // Tracks confirmed
  uint16_t tracks_confirmed;
  // Tracks deleted because they were no longer seen, or too uncertain
  uint16_t tracks_deleted;
  // Tracks deleted because an older one follows the same target
  uint16_t duplicates_deleted;
  // Corrections refused because they would have broken a covariance
  uint16_t numeric_resets;
  // Clusters whose lightest joint events were given up
  uint16_t clusters_bounded;
  // Clusters for which joint probabilities could only be approximated
  uint16_t clusters_approximated;
  // Clusters without any possible joint event
  uint16_t clusters_infeasible;
  // Pairs of tracks that the sensor may not tell apart, beyond the room for them
  uint16_t pairs_refused;
  // Every association probability of a bounded cluster is within this of the exact one
  float association_error_bound;
  // A bound on the share of probability that hypotheses given up had
  float truncated_mass;
} boresight_report;

// A track at the time of the last scan.
typedef struct {
  // Its identity, never given to another
  uint32_t id;
  // How far it is trusted
  boresight_trust trust;
  // The probability that the target exists
  float existence;
  // x, y, z [m]; 0 in axes that the tracker does not have
  float position[3];
  // The velocity [m/s]
  float velocity[3];
  // Covariance of the position: xx, xy, xz, yy, yz, zz [m²]
  float covariance[6];
} boresight_track;

// All that is known of one track.
typedef struct {
  // How many states there are: the first ones of `mean`
  uint32_t states;
  // How many modes there are: the first ones of `mode_probability`
  uint32_t modes;
  // The states, in the order of the configuration
  float mean[BORESIGHT_STATES];
  // Upper triangle of the covariance, by rows
  float covariance[BORESIGHT_COVARIANCE];
  // The probabilities of the modes
  float mode_probability[BORESIGHT_MODES];
} boresight_density;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// IMM-JPDA, states (x, vx, y, vy); range, azimuth
extern const boresight_kind boresight_turning_ra;

// IMM-JPDA, states (x, vx, y, vy); range, azimuth, range-rate
extern const boresight_kind boresight_turning_rar;

// IMM-JPDA, states (x, vx, ax, y, vy, ay); range, azimuth
extern const boresight_kind boresight_accelerating_ra;

// IMM-JPDA, states (x, vx, ax, y, vy, ay); range, azimuth, range-rate
extern const boresight_kind boresight_accelerating_rar;

// Writes the numbers that `kind` starts from to `parameters`.
//
// Needs:
// `parameters` is NULL or can be written; `kind` is NULL or a kind.
boresight_status boresight_defaults(const boresight_kind *kind, boresight_parameters *parameters);

// Makes a tracker of `kind` in `size` bytes at `memory` and writes its address to `tracker`, or NULL where it fails. The memory
// must be aligned to BORESIGHT_ALIGN; what it holds does not matter. A tracker needs no clean-up, and holds no address of itself:
// it may be copied with its memory.
//
// Needs:
// Every pointer is NULL or valid; `memory` holds `size` bytes, and nothing else uses them as long as the tracker is in use.
boresight_status boresight_create(const boresight_kind *kind,
                                  void *memory,
                                  size_t size,
                                  const boresight_parameters *parameters,
                                  boresight_tracker **tracker);

// Gives the tracker other numbers: a moving radar's place before each scan, for example. The tracks stay. A log goes on with
// another `boresight_log_header`.
//
// Needs:
// Both are NULL or valid, `tracker` by `boresight_create`.
boresight_status boresight_configure(boresight_tracker *tracker,
                                     const boresight_parameters *parameters);

// Takes in one scan: `count` detections made at `time_us`, in microseconds since any epoch. No detections is a scan as well: the
// radar looked and saw nothing. Writes what it did to `report` unless that is NULL; a report is never an error.
//
// Needs:
// Every pointer is NULL or valid; `detections` holds `count` of them, or is NULL with a `count` of 0.
boresight_status boresight_step(boresight_tracker *tracker,
                                uint64_t time_us,
                                const boresight_detection *detections,
                                size_t count,
                                boresight_report *report);

// Writes the live tracks to `tracks`, at most `capacity` of them, and to `count` how many there are; that may be more.
//
// Needs:
// Every pointer is NULL or valid; `tracks` has room for `capacity` tracks, or is NULL with a `capacity` of 0.
boresight_status boresight_tracks(boresight_tracker *tracker, boresight_track *tracks, size_t capacity, size_t *count);

// Writes all that is known of the track `id` to `density`.
//
// Needs:
// Both are NULL or valid.
boresight_status boresight_track_density(boresight_tracker *tracker, uint32_t id, boresight_density *density);

// Writes what a log begins with to `out`, and its length to `length`: BORESIGHT_LOG_HEADER. `kind` and `parameters` are those that the
// tracker was created with, or, where the log goes on after `boresight_configure`, has now. The log is for `host-tests
// replay-log`, which does the same again to the same bits.
//
// Needs:
// Every pointer is NULL or valid; `out` has room for `capacity` bytes.
boresight_status boresight_log_header(const boresight_kind *kind,
                                      const boresight_parameters *parameters,
                                      uint8_t *out,
                                      size_t capacity,
                                      size_t *length);

// Writes the record of the last scan, taken in or refused, to `out`, and its length to `length`. A scan has one record; one that got
// none is a gap that the desk finds. BORESIGHT_LOG_RECORD bytes are enough for every ready configuration, and asked for whatever
// the scan.
//
// Needs:
// Every pointer is NULL or valid, `tracker` by `boresight_create`; `out` has room for `capacity` bytes.
boresight_status boresight_log_scan(boresight_tracker *tracker,
                                    uint8_t *out,
                                    size_t capacity,
                                    size_t *length);

// The meaning of a status in words, for a log; it lives for ever.
const char *boresight_text(uint32_t status);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* BORESIGHT_H */
