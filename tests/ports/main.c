/* The one conformance test of all ports (README.md), run against the rig that this program is linked with. */
#include "expect.h"

void setUp(void) {
    rig.start(EXPECT_BEGIN_ms);
}

void tearDown(void) {
    rig.stop();
}

int main(int argc, char **argv) {
    rig_arguments(argc, argv);
    UNITY_BEGIN();
    expect_frames();
    expect_bad_frames();
    expect_time();
    expect_queues();
    expect_trouble();
    expect_store();
    return UNITY_END();
}
