/**
 * The board's end of drive.h: a station that a simulation calls, frame by frame, over SLCAN. Emulated boards have it in their
 * main loop, and tests on the host; a product has none of this.
 *
 *     static taper_driven_t driven;
 *     taper_driven_init(&driven, &slcan, &station, &options, &board, false);
 *     for (;;) {
 *         if (!taper_driven_serve(&driven, now_ms())) {
 *             ... nobody drives: step and poll the station by the board's own clock
 *         }
 *     }
 */
#ifndef TAPER_DRIVEN_H
#define TAPER_DRIVEN_H

#include "taper/drive.h"
#include "taper/slcan.h"
#include "taper/station.h"

/** What only the board can do. Each function may be NULL: then nothing happens, and the answer is 0 or false. */
typedef struct {
    void *context;
    /** Figures of the stack and the store. */
    uint32_t (*figure)(void *context, taper_drive_figure_t figure);
    /** A simulation takes the clock for a new station: empty the store, and keep the settings over a reset. */
    void (*set_up)(void *context, const taper_drive_setup_t *setup);
    /** It takes the clock again after a reset. @return false: no settings were kept. */
    bool (*resume)(void *context, taper_drive_setup_t *setup);
    /** Around every step, poll and stop, and the taking in of frames: a watchdog, a count of instructions. @return instructions since the beginning. */
    void (*call_begins)(void *context);
    uint32_t (*call_ends)(void *context);
    /** How often the station kicked the watchdog, free-running. */
    uint32_t (*kicks)(void *context);
    /** Reset the board, which then greets whoever is attached: taper_driven_serve(). Need not return. */
    void (*reset)(void *context);
    /** End the emulator. Need not return. */
    void (*exit)(void *context, uint8_t status);
} taper_driven_board_t;

/** The caller owns it. Private. */
typedef struct {
    taper_slcan_t *slcan;
    taper_station_t *station;
    taper_station_options_t options; /**< as the board runs by itself */
    taper_driven_board_t board;
    bool was_open;  /**< the channel, when last looked at */
    uint32_t opens; /**< of it, by then */
    bool is_driven; /**< somebody else has the clock */
    bool is_ready;  /**< the station took its settings, and may be called */
    uint32_t now_ms;
    uint16_t slice_iterations;                 /**< of the last step */
    bool is_hearing;                           /**< frames are being taken in: no call of the simulation's */
    uint64_t heard_instructions, heard_frames; /**< since the station was made */
    uint32_t heard_since_step, heard_worst;    /**< instructions for the frames between two steps */
    taper_drive_setup_t setup;                 /**< as far as it has come */
    taper_station_config_t config;
    taper_connector_config_t connectors[TAPER_MAX_CONNECTORS];
    taper_policy_t policy;
} taper_driven_t;

/**
 * Nobody drives yet, unless a simulation had the clock when the board was reset: `is_driven`. A channel that is open already
 * is greeted by the next taper_driven_serve(). `options` and `board` are copied; `slcan`, `station` and what the options point
 * to must outlive `driven`. The port of the options sends and receives by `slcan`.
 */
void taper_driven_init(taper_driven_t *driven, taper_slcan_t *slcan, taper_station_t *station,
                       const taper_station_options_t *options, const taper_driven_board_t *board,
                       bool is_driven);

/**
 * Move bytes, and do what was asked for: as much as has come. Until the first SETUP or RESUME, frames are received at
 * `now_ms`.
 * @return whether a simulation has the clock. The caller must then leave the station alone.
 */
bool taper_driven_serve(taper_driven_t *driven, uint32_t now_ms);

#endif
