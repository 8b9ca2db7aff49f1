/** A CAN controller's restart after bus-off, as `ip link set can0 type can restart` does it. */
#ifndef CAN_RESTART_H
#define CAN_RESTART_H

/** Ask for it. Without CAP_NET_ADMIN, or on an interface that knows no restart, nothing happens. */
void taper_can_restart(const char *interface);

#endif
