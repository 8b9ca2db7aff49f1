/** The envelope of a transfer and its items, as bytes. Private to transfers.c. */
#ifndef TAPER_TRANSFER_WIRE_H
#define TAPER_TRANSFER_WIRE_H

#include "taper/transfers.h"

/** A transfer whose envelope is good. `items` point into the message. */
typedef struct {
    uint8_t type;
    uint16_t count;
    const uint8_t *items;
} taper_transfer_t;

/** Look into a message. @return ACCEPTED, or CRC or VERSION: what is wrong with its envelope. */
taper_transfer_answer_t taper_transfer_open(const uint8_t *message, uint16_t length,
                                            taper_transfer_t *transfer);

/** Write an ANSWER to `message`. @return its length, TAPER_TRANSFER_ENVELOPE + 1. */
uint16_t taper_transfer_write_answer(uint8_t *message, taper_transfer_answer_t answer);

/** Write the newest events, oldest of them first, as a LOG. @return its length. */
uint16_t taper_transfer_write_log(uint8_t *message, const taper_event_log_t *events);

/** Read a curve. @return ACCEPTED and `curve` filled, or why not; `curve` is not touched then. */
taper_transfer_answer_t taper_transfer_read_curve(const taper_transfer_t *transfer,
                                                  const taper_transfer_scene_t *scene,
                                                  taper_limit_curve_t *curve);

/** The same for prices. */
taper_transfer_answer_t taper_transfer_read_price(const taper_transfer_t *transfer,
                                                  const taper_transfer_scene_t *scene,
                                                  taper_price_curve_t *price);

/** Read an identifier, [TAPER_IDENTIFIER_LENGTH + 1]. @return ACCEPTED, or CONTENT and nothing touched. */
taper_transfer_answer_t taper_transfer_read_identifier(const taper_transfer_t *transfer, char *identifier);

#endif
