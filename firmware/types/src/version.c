#include "taper/version.h"

const char *taper_version(void) {
    return TAPER_VERSION;
}
