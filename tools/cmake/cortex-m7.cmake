# Cortex-M7 with the double-precision unit.
set(TAPER_CORE_FLAGS "-mcpu=cortex-m7 -mfpu=fpv5-d16")
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
