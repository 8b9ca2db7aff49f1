# How Python tests become tests of CTest.

# taper_pytest(NAME FOLDER [NAME=VALUE...]): the Python tests of tests/FOLDER, with environment variables.
function(taper_pytest name folder)
    add_test(NAME ${name}
        COMMAND ${TAPER_PYTHON} -m pytest -q -p no:cacheprovider ${PROJECT_SOURCE_DIR}/tests/${folder}
        WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    set_tests_properties(${name} PROPERTIES ENVIRONMENT "PYTHONDONTWRITEBYTECODE=1;${ARGN}" TIMEOUT 900)
endfunction()
