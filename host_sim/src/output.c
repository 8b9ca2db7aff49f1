#define _POSIX_C_SOURCE 200809L

#include "output.h"

#include <errno.h>
#include <libgen.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "memory.h"

/** `a`, `b`, `c` in one string of its own. */
static char *join(const char *a, const char *b, const char *c) {
    const size_t size = strlen(a) + strlen(b) + strlen(c) + 1;
    char *text = sim_allocate(size, 1);
    snprintf(text, size, "%s%s%s", a, b, c);
    return text;
}

static bool fail(const char *directory, const char *what, int error) {
    fprintf(stderr, "%s: %s: %s\n", directory, what, strerror(error));
    return false;
}

/** The name without slashes at its end, so that something can be appended; "/" stays. */
static char *without_slashes(const char *directory) {
    char *name = sim_copy(directory);
    for (size_t length = strlen(name); length > 1 && name[length - 1] == '/'; length--) {
        name[length - 1] = '\0';
    }
    return name;
}

static bool is_directory(const char *name) {
    struct stat info;
    if (stat(name, &info) != 0) {
        return false;
    }
    if (!S_ISDIR(info.st_mode)) {
        errno = ENOTDIR;
        return false;
    }
    return true;
}

/** Whether `directory` and its missing parents could be made: what is there of its path ends in one to write to. */
static bool can_be_made(const char *directory) {
    char *copy = sim_copy(directory);
    const char *there = dirname(copy);
    struct stat info;
    while (lstat(there, &info) != 0 && errno == ENOENT) { // ends at "." or "/"
        there = dirname(copy);
    }
    const bool good = is_directory(there) && access(there, W_OK | X_OK) == 0;
    const int error = errno;
    free(copy);
    errno = error;
    return good;
}

bool sim_output_check(const char *directory) {
    if (directory[0] == '\0') {
        return fail("''", "cannot be an output directory", ENOENT);
    }
    if (is_directory(directory)) {
        return access(directory, W_OK | X_OK) == 0 || fail(directory, "cannot be written to", errno);
    }
    if (errno != ENOENT) {
        return fail(directory, "cannot be an output directory", errno);
    }
    return can_be_made(directory) || fail(directory, "cannot be made", errno);
}

static bool write_file(const char *name, const sim_output_t *file) {
    FILE *stream = fopen(name, "wbx");
    if (stream == NULL) {
        return false;
    }
    const bool good = fwrite(file->text, 1, file->size, stream) == file->size;
    const int error = errno;
    const bool closed = fclose(stream) == 0;
    errno = good ? errno : error;
    return good && closed;
}

static bool write_all(const char *directory, const sim_output_t *file, size_t count) {
    bool good = true;
    for (size_t i = 0; i < count && good; i++) {
        char *name = join(directory, "/", file[i].name);
        good = write_file(name, &file[i]);
        free(name);
    }
    return good;
}

/** Put the finished directory `made` in its place. */
static bool move(const char *made, const char *directory, const sim_output_t *file, size_t count) {
    if (!is_directory(directory)) {
        return rename(made, directory) == 0;
    }
    bool good = true;
    for (size_t i = 0; i < count && good; i++) {
        char *from = join(made, "/", file[i].name);
        char *to = join(directory, "/", file[i].name);
        good = rename(from, to) == 0;
        free(from);
        free(to);
    }
    return good;
}

/** Make the missing directories above `place`; `made[i]` becomes true for each that ends before the slash at `i`. */
static bool make_parents(const char *place, bool *made) {
    char *name = sim_copy(place);
    const size_t length = strlen(name);
    bool good = true;
    for (size_t i = 1; i < length && good; i++) {
        if (name[i] == '/') {
            name[i] = '\0';
            made[i] = mkdir(name, 0777) == 0;
            good = made[i] || errno == EEXIST;
            name[i] = '/';
        }
    }
    const int error = errno;
    free(name);
    errno = error;
    return good;
}

/** Remove those again that make_parents() made. */
static void remove_parents(const char *place, const bool *made) {
    char *name = sim_copy(place);
    for (size_t i = strlen(name); i-- > 0;) {
        if (made[i]) {
            name[i] = '\0';
            (void)rmdir(name);
        }
    }
    free(name);
}

/** Remove what is left of the directory that was written to. */
static void clean_up(const char *made, const sim_output_t *file, size_t count) {
    for (size_t i = 0; i < count; i++) {
        char *name = join(made, "/", file[i].name);
        (void)unlink(name);
        free(name);
    }
    (void)rmdir(made);
}

/** mkdtemp() is for the owner only; give the directory the rights that mkdir() would have given. */
static bool usual_rights(const char *directory) {
    const mode_t mask = umask(0);
    (void)umask(mask);
    return chmod(directory, 0777 & ~mask) == 0;
}

/** Let the signals that end a program wait. @return what was blocked before. */
static sigset_t hold_signals(void) {
    static const int ending[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE};
    sigset_t held;
    sigset_t before;
    (void)sigemptyset(&held);
    for (size_t i = 0; i < sizeof ending / sizeof ending[0]; i++) {
        (void)sigaddset(&held, ending[i]);
    }
    (void)sigprocmask(SIG_BLOCK, &held, &before);
    return before;
}

/** Write to a new directory beside `place`, and put it there. */
static bool write_beside(const char *place, const sim_output_t *file, size_t count) {
    char *made = join(place, ".part-", "XXXXXX");
    bool good = mkdtemp(made) != NULL;
    if (good) {
        good = usual_rights(made) && write_all(made, file, count) && move(made, place, file, count);
        const int error = errno;
        clean_up(made, file, count);
        errno = error;
    }
    const int error = errno;
    free(made);
    errno = error;
    return good;
}

bool sim_output_write(const char *directory, const sim_output_t *file, size_t count) {
    char *place = without_slashes(directory);
    bool *parents = sim_allocate(strlen(place) + 1, sizeof *parents);
    const sigset_t before = hold_signals();
    const bool good = make_parents(place, parents) && write_beside(place, file, count);
    if (!good) {
        const int error = errno;
        remove_parents(place, parents);
        (void)fail(directory, "cannot be written to", error);
    }
    (void)sigprocmask(SIG_SETMASK, &before, NULL);
    free(parents);
    free(place);
    return good;
}
