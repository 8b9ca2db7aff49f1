/**
 * A board's port, called from outside: extended frames on a second SLCAN channel, UART1, whose adapter is always open. The bus
 * itself is on UART0, so that it can be jammed.
 *
 * An identifier is REMOTE_ID | kind << 8 | index; values are little-endian. The board has a buffer of REMOTE_WORDS words of 8
 * bytes, for frames and records. A frame is two words: identifier (u16), bus, length, time (u32); data.
 */
#ifndef TAPER_PORTS_REMOTE_H
#define TAPER_PORTS_REMOTE_H

#include "taper/slcan.h"

#define REMOTE_ID    0x1FFE0000u
#define REMOTE_WORDS 256u

/** What is asked, and the answers. */
typedef enum {
    REMOTE_PUT = 0x01,         /**< index: word; its 8 bytes; no answer */
    REMOTE_GET = 0x02,         /**< index: word; WORD */
    REMOTE_HAS = 0x03,         /**< VALUE: bits of remote_has_t */
    REMOTE_RECEIVE = 0x04,     /**< index: so many frames at most; VALUE: how many, then two WORDs for each */
    REMOTE_SEND = 0x05,        /**< the frame of words 0 and 1; VALUE: whether it was taken */
    REMOTE_OVERFLOWS = 0x06,   /**< VALUE */
    REMOTE_KICK = 0x07,        /**< VALUE: 0 */
    REMOTE_CLOCK_US = 0x08,    /**< VALUE */
    REMOTE_NOW = 0x09,         /**< VALUE: the station's clock [ms] */
    REMOTE_SET_NOW = 0x0A,     /**< u32; VALUE: 0 */
    REMOTE_STORE_READ = 0x0B,  /**< index: area << 4 | copy; u32: length; VALUE: whether it was done */
    REMOTE_STORE_WRITE = 0x0C, /**< as above */
    REMOTE_RECORD_MAX = 0x0D,  /**< VALUE: TAPER_STORE_RECORD_MAX */
    REMOTE_RESET = 0x0E,       /**< HELLO when the board is up again; its store stays */
    REMOTE_VALUE = 0x81,       /**< u32 */
    REMOTE_WORD = 0x82,        /**< index: word; 8 bytes */
    REMOTE_HELLO = 0x83,       /**< after every start */
} remote_kind_t;

/** Which callbacks are not NULL. */
typedef enum {
    REMOTE_HAS_KICK_WATCHDOG = 1,
    REMOTE_HAS_CLOCK_US = 2,
    REMOTE_HAS_BUS_IS_OFF = 4,
    REMOTE_HAS_RECEIVE_OVERFLOWS = 8,
    REMOTE_HAS_STORE = 16,
} remote_has_t;

taper_slcan_message_t remote_message(remote_kind_t kind, unsigned index, const void *data, uint8_t length);
taper_slcan_message_t remote_value(remote_kind_t kind, unsigned index, uint32_t value);

unsigned remote_kind(const taper_slcan_message_t *message);
unsigned remote_index(const taper_slcan_message_t *message);
uint32_t remote_u32(const taper_slcan_message_t *message);

void remote_pack(const taper_frame_t *frame, uint8_t words[16]);
void remote_unpack(const uint8_t words[16], taper_frame_t *frame);

#endif
