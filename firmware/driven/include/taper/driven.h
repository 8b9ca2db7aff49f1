/**
 * The board's end of drive.h: a station that a simulation calls, frame by frame, over SLCAN. Emulated boards have it in their
 * main loop, and tests on the host; a product has none of this.
 *
 *     static taper_driven_t driven;
 *     taper_driven_init(&driven, &slcan, &station, &options, &board);
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

/** What only the board knows. Each function may be NULL: then the answer is 0, or nothing happens. */
typedef struct {
    void *context;
    /** Figures of the stack and the store. */
    uint32_t (*figure)(void *context, taper_drive_figure_t figure);
    /** Instructions executed, free-running. */
    uint32_t (*instructions)(void *context);
    /** A call of the station begins, or is over: between calls the clock waits for the simulation, and nobody is to be
        watched. */
    void (*watch)(void *context, bool is_in_call);
    /** A simulation takes the clock by SETUP: a new station, which finds its store empty. */
    void (*set_up)(void *context);
    /** How often the station kicked the watchdog, free-running. */
    uint32_t (*kicks)(void *context);
    /** Reset the board; it greets again (taper_driven_init()). Need not return. */
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
    uint16_t slice_iterations; /**< of the last step */
    taper_drive_setup_t setup; /**< as far as it has come */
    taper_station_config_t config;
    taper_connector_config_t connectors[TAPER_MAX_CONNECTORS];
    taper_policy_t policy;
} taper_driven_t;

/**
 * Nobody drives yet. `options` and `board` are copied; `slcan`, `station` and what the options point to must outlive
 * `driven`. The port of the options sends and receives by `slcan`. A channel that is open already is greeted by the next
 * taper_driven_serve().
 */
void taper_driven_init(taper_driven_t *driven, taper_slcan_t *slcan, taper_station_t *station,
                       const taper_station_options_t *options, const taper_driven_board_t *board);

/**
 * Move bytes, and do what was asked for: as much as has come. Until the first SETUP or RESUME, frames are received at
 * `now_ms`.
 * @return whether a simulation has the clock. The caller must then leave the station alone.
 */
bool taper_driven_serve(taper_driven_t *driven, uint32_t now_ms);

#endif
