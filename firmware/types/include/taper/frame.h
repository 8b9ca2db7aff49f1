/** A classic CAN frame as the station sees it. */
#ifndef TAPER_FRAME_H
#define TAPER_FRAME_H

#include <stdint.h>

/** Every frame of the station bus has this length. */
#define TAPER_FRAME_LENGTH 8

typedef struct {
    uint16_t id;    /**< 11-bit identifier: function << 6 | node */
    uint8_t bus;    /**< which of the station's CAN buses */
    uint8_t length; /**< data length code, 0..8 */
    uint8_t data[TAPER_FRAME_LENGTH];
    uint32_t
        time_ms; /**< when the port received it, on the station's clock; of no meaning in a frame to send */
} taper_frame_t;

#endif
