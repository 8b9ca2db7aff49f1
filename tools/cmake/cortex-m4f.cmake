# Cortex-M4F: its unit knows single precision only, so every double becomes a call that a test finds.
set(TAPER_CORE_FLAGS "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16")
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
