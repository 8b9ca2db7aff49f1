/** taper-station: the station's firmware as a Linux daemon on SocketCAN. `taper-station --help` is the manual. */
#include "daemon.h"

int main(int argc, char **argv) {
    static taper_options_t options;
    static taper_made_t made;
    taper_options_parse(argc, argv, &options, &made);
    return taper_daemon_run(&options, &made);
}
