#include "can_socket.h"

#include <errno.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

/* What a frame costs in a socket's account (sk_buff and data; 64-bit kernels). */
#define FRAME_COST 768
/* A second of a full bus at 1 Mbit/s is 8000 frames. Without CAP_NET_ADMIN most kernels grant 400 KB: 70 ms of that. */
#define RECEIVE_BYTES (8000 * FRAME_COST)

/* A kernel that refuses an option costs us what the option gives, and no more. */
static void ask_for(int fd, int level, int option, const void *value, size_t size) {
    (void)setsockopt(fd, level, option, value, (socklen_t)size);
}

static void ask_for_number(int fd, int level, int option, int value) {
    ask_for(fd, level, option, &value, sizeof value);
}

/* CAN_RAW's defaults stay: other sockets of this machine see our frames, we do not, and CAN FD is off. */
int taper_can_socket_open(void) {
    const int fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (fd < 0) {
        return -1;
    }
    ask_for_number(fd, SOL_SOCKET, SO_TIMESTAMPNS, 1);
    ask_for_number(fd, SOL_SOCKET, SO_RXQ_OVFL, 1);
    ask_for_number(fd, SOL_SOCKET, SO_RCVBUF, RECEIVE_BYTES / 2); /* the kernel doubles all three */
    ask_for_number(fd, SOL_SOCKET, SO_RCVBUFFORCE, RECEIVE_BYTES / 2);
    ask_for_number(fd, SOL_SOCKET, SO_SNDBUF, TAPER_SOCKETCAN_SEND_QUEUE * FRAME_COST / 2);
    return fd;
}

static void set_filters(int fd, const taper_socketcan_filter_t *filters, unsigned count) {
    const canid_t data_frames = CAN_EFF_FLAG | CAN_RTR_FLAG; /* in a mask: neither extended nor remote */
    struct can_filter list[TAPER_SOCKETCAN_FILTERS] = {{.can_id = 0, .can_mask = data_frames}};
    for (unsigned i = 0; i < count; i++) {
        list[i].can_id = filters[i].id & CAN_SFF_MASK;
        list[i].can_mask = (filters[i].mask & CAN_SFF_MASK) | data_frames;
    }
    ask_for(fd, SOL_CAN_RAW, CAN_RAW_FILTER, list, (count > 0 ? count : 1u) * sizeof list[0]);
    const can_err_mask_t errors = CAN_ERR_BUSOFF | CAN_ERR_RESTARTED | CAN_ERR_CRTL;
    ask_for(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
}

bool taper_can_socket_bind(int fd, const char *interface, const taper_socketcan_filter_t *filters,
                           unsigned count) {
    const struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(interface)};
    if (address.can_ifindex == 0) { /* 0 would be all interfaces */
        errno = ENXIO;
        return false;
    }
    set_filters(fd, filters, count);
    return bind(fd, (const struct sockaddr *)&address, sizeof address) == 0;
}

bool taper_can_socket_is_up(int fd, const char *interface) {
    struct ifreq request = {0};
    snprintf(request.ifr_name, sizeof request.ifr_name, "%s", interface);
    return ioctl(fd, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) != 0;
}

bool taper_can_socket_lost(int error) {
    return error == ENETDOWN || error == ENXIO || error == ENODEV;
}

/* The clock may have been set back since. */
static uint32_t age_ms(const struct timespec *stamp, const struct timespec *now) {
    const int64_t ms =
        (int64_t)(now->tv_sec - stamp->tv_sec) * 1000 + (now->tv_nsec - stamp->tv_nsec) / 1000000;
    return ms<0 ? 0 : ms>(int64_t) INT32_MAX ? (uint32_t)INT32_MAX : (uint32_t)ms;
}

static void read_ancillary(struct msghdr *head, const struct timespec *now, can_socket_message_t *message) {
    for (struct cmsghdr *item = CMSG_FIRSTHDR(head); item != NULL; item = CMSG_NXTHDR(head, item)) {
        if (item->cmsg_level == SOL_SOCKET && item->cmsg_type == SCM_TIMESTAMPNS) {
            struct timespec stamp;
            memcpy(&stamp, CMSG_DATA(item), sizeof stamp);
            message->age_ms = age_ms(&stamp, now);
        } else if (item->cmsg_level == SOL_SOCKET && item->cmsg_type == SO_RXQ_OVFL) {
            memcpy(&message->drops, CMSG_DATA(item), sizeof message->drops);
            message->has_drops = true;
        }
    }
}

typedef union {
    size_t align; /* as struct cmsghdr begins */
    char bytes[CMSG_SPACE(sizeof(struct timespec)) + CMSG_SPACE(sizeof(uint32_t))];
} ancillary_t;

unsigned taper_can_socket_read(int fd, can_socket_message_t messages[CAN_SOCKET_BATCH], bool *more,
                               int *error) {
    struct mmsghdr heads[CAN_SOCKET_BATCH] = {0};
    struct iovec frames[CAN_SOCKET_BATCH];
    ancillary_t ancillary[CAN_SOCKET_BATCH];
    for (unsigned i = 0; i < CAN_SOCKET_BATCH; i++) {
        messages[i] = (can_socket_message_t){0};
        frames[i] = (struct iovec){.iov_base = &messages[i].frame, .iov_len = sizeof messages[i].frame};
        heads[i].msg_hdr = (struct msghdr){.msg_iov = &frames[i],
                                           .msg_iovlen = 1,
                                           .msg_control = &ancillary[i],
                                           .msg_controllen = sizeof ancillary[i]};
    }
    const int count = recvmmsg(fd, heads, CAN_SOCKET_BATCH, MSG_DONTWAIT, NULL);
    *more = count == CAN_SOCKET_BATCH;
    *error = count < 0 ? errno : 0;
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    unsigned kept = 0;
    for (int i = 0; i < count; i++) {
        if (heads[i].msg_len != CAN_MTU || (heads[i].msg_hdr.msg_flags & MSG_TRUNC) != 0) {
            continue;
        }
        read_ancillary(&heads[i].msg_hdr, &now, &messages[i]);
        messages[kept++] = messages[i];
    }
    return kept;
}

int taper_can_socket_write(int fd, const struct can_frame *frame) {
    return write(fd, frame, sizeof *frame) == (ssize_t)sizeof *frame ? 0 : errno;
}
