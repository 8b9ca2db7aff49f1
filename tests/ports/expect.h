/** The expectations, by theme, and what they share. */
#ifndef TAPER_PORTS_EXPECT_H
#define TAPER_PORTS_EXPECT_H

#include "rig.h"
#include "unity.h"

/** The clock when a test begins, unless it wants another. */
#define EXPECT_BEGIN_ms 1000000u

void expect_frames(void);
void expect_bad_frames(void);
void expect_time(void);
void expect_queues(void);
void expect_trouble(void);
void expect_store(void);

/** A frame with a running number: all with the same identifier. */
taper_frame_t expect_numbered(uint32_t number);
uint32_t expect_number_of(const taper_frame_t *frame);

/** The world sends it, and it is with the port. */
void expect_say(const taper_frame_t *frame);

/** The station takes the next frame, within the patience. */
taper_frame_t expect_received(void);

/** The world hears the next frame, within the patience. */
taper_frame_t expect_heard(void);

/** All that was sent is there, and the station has nothing to take. */
void expect_nothing_received(void);
void expect_nothing_heard(void);

/** Identifier, bus, length, and as many bytes. */
void expect_equal(const taper_frame_t *expected, const taper_frame_t *frame);

bool expect_send(const taper_frame_t *frame);

#endif
