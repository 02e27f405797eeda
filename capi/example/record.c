/* Tracks the recorded scans of the example in Rust and writes a log of them to standard output, bytes and nothing else, for
 * `host-tests replay-log`. Two scans among them must be refused: one that goes back in time, and one with a plot that is no number.
 * The log is that of the example in Rust, byte by byte. */

#include "../include/boresight.h"
#include "board.h"
#include "recorded.h"

#define LARGEST 32

static _Alignas(BORESIGHT_ALIGN) unsigned char memory[BORESIGHT_ACCELERATING_RA_SIZE];
static unsigned char bytes[BORESIGHT_LOG_RECORD];

/* Offers one scan and records what came of it. Returns whether that is `expected`. */
static int offer(boresight_tracker *tracker, uint64_t time_us, const float (*plots)[2], uint32_t count, boresight_status expected) {
    boresight_detection detections[LARGEST] = {0};
    for (uint32_t i = 0; i < count; i++) {
        detections[i].z[0] = plots[i][0];
        detections[i].z[1] = plots[i][1];
    }
    size_t length;
    boresight_status status = boresight_step(tracker, time_us, detections, count, NULL);
    if (boresight_log_scan(tracker, bytes, sizeof bytes, &length) != BORESIGHT_STATUS_OK) return 0;
    send(bytes, length);
    return status == expected;
}

int main(void) {
    static const float NO_NUMBER[1][2] = {{__builtin_nanf(""), 0.0f}};
    boresight_parameters parameters;
    boresight_tracker *tracker;
    size_t length;
    if (boresight_defaults(&boresight_accelerating_ra, &parameters) != BORESIGHT_STATUS_OK) return 1;
    if (boresight_create(&boresight_accelerating_ra, memory, sizeof memory, &parameters, &tracker) != BORESIGHT_STATUS_OK) return 1;
    if (boresight_log_header(&boresight_accelerating_ra, &parameters, bytes, sizeof bytes, &length) != BORESIGHT_STATUS_OK) return 1;
    send(bytes, length);

    const float (*plots)[2] = PLOTS;
    for (uint32_t k = 0; k < SCANS; plots += PLOTS_OF_SCAN[k++]) {
        uint64_t now = (uint64_t)k * PERIOD_US;
        if (!offer(tracker, now, plots, PLOTS_OF_SCAN[k], BORESIGHT_STATUS_OK)) return 1;
        if (k == 20 && !offer(tracker, now - 1000, plots, PLOTS_OF_SCAN[k], BORESIGHT_STATUS_SCAN_TIME_REVERSED)) return 1;
        if (k == 40 && !offer(tracker, now + 1000, NO_NUMBER, 1, BORESIGHT_STATUS_SCAN_DETECTION_NOT_FINITE)) return 1;
    }
    return 0;
}
