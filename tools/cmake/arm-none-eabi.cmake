# Bare-metal Arm, with newlib's nano variant. The toolchain files of the cores say which one.

set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # nothing links before there is start-up code
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE NEVER)

# The last option makes no code: what GCC knows of stack and calls goes into .ci files, for tools/budgets.
set(CMAKE_C_FLAGS_INIT
    "${TAPER_CORE_FLAGS} -mthumb -mfloat-abi=hard -ffunction-sections -fdata-sections -fno-common -fcallgraph-info=su")
set(CMAKE_EXE_LINKER_FLAGS_INIT "${TAPER_CORE_FLAGS} -mthumb -mfloat-abi=hard --specs=nano.specs -Wl,--gc-sections")
