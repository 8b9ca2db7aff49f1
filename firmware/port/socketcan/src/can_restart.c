#include "can_restart.h"

#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <stddef.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define KIND "can"

/* The message as it lies in memory: attributes in attributes, each on a boundary of 4 bytes. */
typedef struct {
    struct nlmsghdr head;
    struct ifinfomsg link;
    struct rtattr info; /* IFLA_LINKINFO, up to the end */
    struct rtattr kind;
    char kind_name[RTA_ALIGN(sizeof KIND)];
    struct rtattr data; /* IFLA_INFO_DATA, up to the end */
    struct rtattr restart;
    __u32 restart_value;
} restart_message_t;

_Static_assert(sizeof(restart_message_t) == NLMSG_LENGTH(sizeof(struct ifinfomsg)) + 4u * RTA_LENGTH(0) +
                                                RTA_ALIGN(sizeof KIND) + sizeof(__u32),
               "netlink knows no other padding");

static struct rtattr attribute(unsigned type, size_t size) {
    const struct rtattr attribute = {.rta_len = (unsigned short)size, .rta_type = (unsigned short)type};
    return attribute;
}

void taper_can_restart(const char *interface) {
    restart_message_t message = {
        .head = {.nlmsg_len = sizeof message, .nlmsg_type = RTM_NEWLINK, .nlmsg_flags = NLM_F_REQUEST},
        .link = {.ifi_family = AF_UNSPEC, .ifi_index = (int)if_nametoindex(interface)},
        .info = attribute(IFLA_LINKINFO, sizeof message - offsetof(restart_message_t, info)),
        .kind = attribute(IFLA_INFO_KIND, RTA_LENGTH(sizeof KIND)),
        .data = attribute(IFLA_INFO_DATA, sizeof message - offsetof(restart_message_t, data)),
        .restart = attribute(IFLA_CAN_RESTART, RTA_LENGTH(sizeof(__u32))),
        .restart_value = 1,
    };
    memcpy(message.kind_name, KIND, sizeof KIND);
    const int fd = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
    if (fd < 0) {
        return;
    }
    /* The kernel acts within send(). Whether it did is told by an error frame on the bus, CAN_ERR_RESTARTED. */
    (void)!send(fd, &message, sizeof message, MSG_DONTWAIT);
    close(fd);
}
