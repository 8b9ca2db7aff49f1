/**
 * How a simulation drives a station on an emulated board: its clock and its calls, by extended frames among the others on
 * SLCAN. The station bus has 11-bit identifiers only, so the two never mix. A product has none of this; only the main of the
 * emulated boards obeys it.
 *
 * From SETUP on the board's own clock stands still. Frames count as received at the last TIME, and are taken in as they come
 * (taper_station_hear()); STEP and POLL call
 * taper_station_step() and taper_station_poll(), and are answered by DONE once all that the station sent is on the wire. So a
 * run goes as fast as the emulator, and repeats to the bit.
 *
 * An identifier is TAPER_DRIVE_ID | kind << 8 | index. Values are little-endian.
 */
#ifndef TAPER_DRIVE_H
#define TAPER_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/message.h"
#include "taper/slcan.h"
#include "taper/types.h"

#define TAPER_DRIVE_ID 0x1FFF0000u

/** What is asked, from 1, and what is answered, from 0x81. */
typedef enum {
    TAPER_DRIVE_SETUP =
        0x01, /**< a new station with the settings that follow and an empty store; DONE says whether it was taken */
    TAPER_DRIVE_TIME = 0x03,    /**< u32: reception time of the frames that follow [ms]; no answer */
    TAPER_DRIVE_STEP = 0x04,    /**< u32: now [ms]; DONE */
    TAPER_DRIVE_POLL = 0x05,    /**< u32: now [ms]; DONE */
    TAPER_DRIVE_STOP = 0x06,    /**< u32: now [ms]; DONE */
    TAPER_DRIVE_LOOK = 0x07,    /**< index: connector; LOOKED */
    TAPER_DRIVE_COUNTER = 0x08, /**< index: taper_counter_t; VALUE */
    TAPER_DRIVE_FIGURE = 0x09,  /**< index: taper_drive_figure_t; VALUE */
    TAPER_DRIVE_RESET =
        0x0A, /**< the board resets; what is in its store stays, the channel stays open; HELLO when it is up */
    TAPER_DRIVE_EXIT = 0x0B, /**< index: exit status of the emulator; no answer */
    TAPER_DRIVE_RESUME =
        0x0C, /**< a new station with the settings of the last SETUP, and what the store has kept, after a reset; DONE */
    TAPER_DRIVE_DONE = 0x81,   /**< taper_drive_done_t; index: the kind that it answers */
    TAPER_DRIVE_LOOKED = 0x82, /**< index: connector; a taper_outlook_t (taper_drive_looked()) */
    TAPER_DRIVE_VALUE = 0x83,  /**< index as asked; u32 */
    TAPER_DRIVE_HELLO =
        0x84, /**< sent when the channel is opened and after a reset; u32: TAPER_DRIVE_VERSION */
} taper_drive_kind_t;

#define TAPER_DRIVE_VERSION 1u

/** What a board tells of itself. */
typedef enum {
    TAPER_DRIVE_ITERATIONS,   /**< of the last finished solve */
    TAPER_DRIVE_STACK_USED_B, /**< most since the start of the image */
    TAPER_DRIVE_STACK_SIZE_B,
    TAPER_DRIVE_SLICE_ITERATIONS, /**< solver iterations in the last step */
    TAPER_DRIVE_STORE_WRITES,     /**< since the start of the image */
    TAPER_DRIVE_BUILT_FOR,        /**< connectors of the board's station */
    TAPER_DRIVE_NAME,             /**< CRC-32 of the name of the board's station */
    TAPER_DRIVE_HAS_PLANNER,      /**< 1: the image has one */
    TAPER_DRIVE_FRAME_MEAN, /**< instructions to take in a frame, on average since SETUP or RESUME; 0: not known */
    TAPER_DRIVE_FRAMES_WORST, /**< most instructions for all frames that came between two steps */
    TAPER_DRIVE_FIGURES
} taper_drive_figure_t;

/** Who proposes. */
typedef enum {
    TAPER_DRIVE_PLANNER,
    TAPER_DRIVE_EDF,
    TAPER_DRIVE_LLF,
} taper_drive_policy_t;

/** Settings of a run, in two frames with index 0 and 1; the second one makes the station. */
typedef struct {
    uint32_t tick_ms;
    uint16_t iterations_per_tick;
    uint8_t policy;                /**< taper_drive_policy_t */
    int32_t min_mA;                /**< of every connector; absent: as described */
    int32_t price_weight_permille; /**< absent: as described */
} taper_drive_setup_t;

typedef struct {
    bool ok;               /**< the station took its settings; else DONE of SETUP */
    bool hands_over;       /**< taper_station_hands_over() */
    bool is_settled;       /**< taper_station_is_settled() */
    bool watchdog_kicked;  /**< in this call */
    bool planned;          /**< the planner stated a problem or worked on one in this call */
    uint8_t mode;          /**< taper_mode_t */
    uint16_t plans;        /**< TAPER_COUNTER_PLANS, its low 16 bits */
    uint32_t instructions; /**< of the call, to about 40, without frames going over the wire; 0: not known */
} taper_drive_done_t;

/** Whether a message belongs here; then its kind and index. */
bool taper_drive_split(const taper_slcan_message_t *message, uint8_t *kind, uint8_t *index);

/** A message with a u32 as its data, or of none. */
taper_slcan_message_t taper_drive_u32(taper_drive_kind_t kind, uint8_t index, uint32_t value);
taper_slcan_message_t taper_drive_plain(taper_drive_kind_t kind, uint8_t index);

/** @return 0 for a message that is too short. */
uint32_t taper_drive_get_u32(const taper_slcan_message_t *message);

/** The two frames of SETUP, `part` 0 and 1, and back. @return false: too short. */
taper_slcan_message_t taper_drive_setup(const taper_drive_setup_t *setup, unsigned part);
bool taper_drive_get_setup(const taper_slcan_message_t *message, taper_drive_setup_t *setup);

taper_slcan_message_t taper_drive_done(taper_drive_kind_t of, const taper_drive_done_t *done);
bool taper_drive_get_done(const taper_slcan_message_t *message, taper_drive_done_t *done);

taper_slcan_message_t taper_drive_looked(uint8_t connector, const taper_outlook_t *outlook);
bool taper_drive_get_looked(const taper_slcan_message_t *message, taper_outlook_t *outlook);

#endif
