/* Tracks the recorded scans of the example in Rust, and compares every track after every scan with what the tracker in Rust
 * tells of it: bit by bit. Then shows what refuses what. The same file runs on the microcontroller and on a PC. */

#include "../include/boresight.h"
#include "board.h"
#include "recorded.h"

#define CAPACITY 16
#define LARGEST 32
#define STATES 6
#define MODES 3

/* The tracker's memory: a static like any other. */
static _Alignas(BORESIGHT_ALIGN) unsigned char memory[BORESIGHT_ACCELERATING_RA_SIZE];

static uint32_t differences;
static const uint32_t *expected = EXPECTED;

static uint32_t bits(float value) {
    union { float value; uint32_t bits; } both = {.value = value};
    return both.bits;
}

static void compare(float value) {
    differences += bits(value) != *expected++;
}

static void compare_all(const float *values, uint32_t count) {
    while (count--) compare(*values++);
}

static int fail(const char *what, boresight_status status) {
    say(what);
    say(": ");
    say(boresight_text(status));
    say("\n");
    return 1;
}

/* One scan into the tracker, all tracks out. */
static int scan(boresight_tracker *tracker, uint32_t k, const float (*plots)[2]) {
    boresight_detection detections[LARGEST] = {0};
    for (uint32_t i = 0; i < PLOTS_OF_SCAN[k]; i++) {
        detections[i].z[0] = plots[i][0];
        detections[i].z[1] = plots[i][1];
    }
    boresight_report report;
    boresight_status status = boresight_step(tracker, (uint64_t)k * PERIOD_US, detections, PLOTS_OF_SCAN[k], &report);
    if (status != BORESIGHT_STATUS_OK) return fail("scan", status);

    boresight_track tracks[CAPACITY];
    size_t count;
    status = boresight_tracks(tracker, tracks, CAPACITY, &count);
    if (status != BORESIGHT_STATUS_OK) return fail("tracks", status);
    if (count != TRACKS_OF_SCAN[k] || report.detections != PLOTS_OF_SCAN[k]) return fail("counts", status);
    for (size_t i = 0; i < count; i++) {
        boresight_density density;
        status = boresight_track_density(tracker, tracks[i].id, &density);
        if (status != BORESIGHT_STATUS_OK) return fail("density", status);
        if (density.states != STATES || density.modes != MODES) return fail("shape", status);
        compare((float)tracks[i].id);
        compare_all(density.mode_probability, MODES);
        compare_all(density.mean, STATES);
        compare_all(density.covariance, STATES * (STATES + 1) / 2);
    }
    return 0;
}

int main(void) {
    boresight_parameters parameters;
    boresight_tracker *tracker;
    boresight_status status = boresight_defaults(&boresight_accelerating_ra, &parameters);
    if (status != BORESIGHT_STATUS_OK) return fail("defaults", status);
    status = boresight_create(&boresight_accelerating_ra, memory, sizeof memory, &parameters, &tracker);
    if (status != BORESIGHT_STATUS_OK) return fail("create", status);

    const float (*plots)[2] = PLOTS;
    for (uint32_t k = 0; k < SCANS; plots += PLOTS_OF_SCAN[k++])
        if (scan(tracker, k, plots)) return 1;
    uint32_t values = (uint32_t)(expected - EXPECTED);
    say_number(values);
    say(" values of ");
    say_number(sizeof EXPECTED / sizeof *EXPECTED);
    say(", ");
    say_number(differences);
    say(" differ from the tracker in Rust\n");
    if (values != sizeof EXPECTED / sizeof *EXPECTED || differences) return 1;

    /* What is refused changes nothing: an older scan, a negative probability, memory that holds no tracker. */
    static _Alignas(BORESIGHT_ALIGN) unsigned char nothing[sizeof memory];
    parameters.p_detect = -1.0f;
    if (boresight_step(tracker, 0, NULL, 0, NULL) != BORESIGHT_STATUS_SCAN_TIME_REVERSED ||
        boresight_configure(tracker, &parameters) != BORESIGHT_STATUS_CONFIG_NOT_A_PROBABILITY ||
        boresight_step((boresight_tracker *)nothing, 0, NULL, 0, NULL) != BORESIGHT_STATUS_NO_TRACKER ||
        boresight_create(&boresight_accelerating_ra, memory, 100, &parameters, &tracker) != BORESIGHT_STATUS_MEMORY)
        return fail("not refused", BORESIGHT_STATUS_OK);
    return 0;
}
