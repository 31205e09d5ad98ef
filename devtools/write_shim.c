// Counts the calls by which a command writes under a folder, by kind; at a chosen call it kills the command, or refuses the
// call with an error. Loaded by LD_PRELOAD.
//
// LAB_SHIM_UNDER: the folder. LAB_SHIM_COUNTS: a file of 9 numbers of 4 bytes, shared by all processes of the command, in the
// order of `enum kind`, the last one for the chosen kinds together. LAB_SHIM_KINDS: letters of the chosen kinds, as in LETTERS;
// LAB_SHIM_AT: the chosen call among these, from 1; 0: none. LAB_SHIM_DO: "before" or "after" the call, or after "half" of a
// write, the whole process group is killed; a number: the call gives that errno. LAB_SHIM_ALWAYS: also at all later calls.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum kind { OPEN, WRITE, SYNC, RENAME, UNLINK, MKDIR, TRUNCATE, LINK, KINDS };
#define LETTERS "owsrumtl"
enum { PASS, BEFORE, AFTER, HALF, REFUSE };

static char under[PATH_MAX];
static size_t under_length;
static atomic_uint *counts; // a number a kind, then the number of all chosen kinds
static unsigned meant, at, always;
static int deed = PASS, refusal;

// Reads the environment when a process begins, and again in a process that is forked for a command of its own.
__attribute__((constructor)) void write_shim_begin(void) {
    counts = NULL;
    meant = at = always = 0;
    deed = PASS;
    const char *folder = getenv("LAB_SHIM_UNDER"), *file = getenv("LAB_SHIM_COUNTS");
    const char *kinds = getenv("LAB_SHIM_KINDS"), *when = getenv("LAB_SHIM_AT"), *what = getenv("LAB_SHIM_DO");
    if (!folder || !file || strlen(folder) >= sizeof under) return;
    int handle = (int)syscall(SYS_openat, AT_FDCWD, file, O_RDWR | O_CLOEXEC, 0);
    if (handle < 0) return;
    void *shared = mmap(NULL, (KINDS + 1) * sizeof *counts, PROT_READ | PROT_WRITE, MAP_SHARED, handle, 0);
    close(handle);
    if (shared == MAP_FAILED) return;
    for (const char *letter = kinds ? kinds : ""; *letter; letter++) {
        const char *found = strchr(LETTERS, *letter);
        if (found) meant |= 1u << (found - LETTERS);
    }
    at = when ? (unsigned)atoi(when) : 0;
    always = getenv("LAB_SHIM_ALWAYS") != NULL;
    if (what && at) {
        deed = !strcmp(what, "before") ? BEFORE : !strcmp(what, "after") ? AFTER : !strcmp(what, "half") ? HALF : REFUSE;
        refusal = deed == REFUSE ? atoi(what) : 0;
    }
    strcpy(under, folder);
    under_length = strlen(under);
    counts = shared;
}

static void *next_of(const char *name) { return dlsym(RTLD_NEXT, name); }
#define REAL(type, name, ...)                                                                                                  \
    static type (*real)(__VA_ARGS__);                                                                                          \
    if (!real) real = (type(*)(__VA_ARGS__))next_of(name)

static int starts_under(const char *path) {
    return !strncmp(path, under, under_length) && (path[under_length] == '/' || path[under_length] == 0);
}

static int file_is_under(int file) {
    char link[40], path[PATH_MAX];
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return starts_under(path);
}

static int is_under(int folder, const char *path) {
    if (!path) return 0;
    if (path[0] == '/') return starts_under(path);
    if (folder != AT_FDCWD) return file_is_under(folder);
    char here[PATH_MAX];
    return getcwd(here, sizeof here) && starts_under(here); // "../x" counts as under the working folder
}

static _Noreturn void die(void) {
    kill(0, SIGKILL);
    for (;;) pause();
}

// Counts a call, and returns what is to become of it; kills the process group if that comes before the call.
static int counted(enum kind kind, int counts_here) {
    if (!counts || !counts_here) return PASS;
    int before = errno;
    atomic_fetch_add(&counts[kind], 1);
    int now = PASS;
    if (meant & (1u << kind)) {
        unsigned number = atomic_fetch_add(&counts[KINDS], 1) + 1;
        if (deed != PASS && (number == at || (always && number > at))) now = deed;
    }
    if (now == BEFORE || (now == HALF && kind != WRITE)) die();
    errno = now == REFUSE ? refusal : before;
    return now;
}

#define AROUND(kind, here, call)                                                                                               \
    do {                                                                                                                       \
        int now_ = counted(kind, here);                                                                                        \
        if (now_ == REFUSE) return -1;                                                                                         \
        if (now_ == PASS) return call;                                                                                         \
        (void)!(call);                                                                                                         \
        die();                                                                                                                 \
    } while (0)

static int writes(int flags) { return (flags & O_ACCMODE) != O_RDONLY || flags & (O_CREAT | O_TRUNC); }

#define MODE_OF(flags, last)                                                                                                   \
    mode_t mode = 0;                                                                                                           \
    if ((flags) & (O_CREAT | O_TMPFILE)) {                                                                                     \
        va_list more;                                                                                                          \
        va_start(more, last);                                                                                                  \
        mode = va_arg(more, mode_t);                                                                                           \
        va_end(more);                                                                                                          \
    }

#define OPENS(name)                                                                                                            \
    int name(const char *path, int flags, ...) {                                                                               \
        MODE_OF(flags, flags)                                                                                                  \
        REAL(int, #name, const char *, int, ...);                                                                              \
        AROUND(OPEN, writes(flags) && is_under(AT_FDCWD, path), real(path, flags, mode));                                      \
    }
OPENS(open)
OPENS(open64)

#define OPENS_AT(name)                                                                                                         \
    int name(int folder, const char *path, int flags, ...) {                                                                   \
        MODE_OF(flags, flags)                                                                                                  \
        REAL(int, #name, int, const char *, int, ...);                                                                         \
        AROUND(OPEN, writes(flags) && is_under(folder, path), real(folder, path, flags, mode));                                \
    }
OPENS_AT(openat)
OPENS_AT(openat64)

#define CHECKED_OPENS(name)                                                                                                    \
    int name(const char *path, int flags) {                                                                                    \
        REAL(int, #name, const char *, int);                                                                                   \
        AROUND(OPEN, writes(flags) && is_under(AT_FDCWD, path), real(path, flags));                                            \
    }
CHECKED_OPENS(__open_2)
CHECKED_OPENS(__open64_2)

int creat(const char *path, mode_t mode) {
    REAL(int, "creat", const char *, mode_t);
    AROUND(OPEN, is_under(AT_FDCWD, path), real(path, mode));
}

#define STREAMS(name)                                                                                                          \
    FILE *name(const char *path, const char *mode) {                                                                           \
        REAL(FILE *, #name, const char *, const char *);                                                                       \
        int now = counted(OPEN, mode && strpbrk(mode, "wa+") && is_under(AT_FDCWD, path));                                     \
        if (now == REFUSE) return NULL;                                                                                        \
        FILE *opened = real(path, mode);                                                                                       \
        if (now != PASS) die();                                                                                                \
        return opened;                                                                                                         \
    }
STREAMS(fopen)
STREAMS(fopen64)

ssize_t write(int file, const void *from, size_t size) {
    REAL(ssize_t, "write", int, const void *, size_t);
    int now = counted(WRITE, counts && file > 2 && file_is_under(file));
    if (now == REFUSE) return -1;
    if (now == HALF) size /= 2;
    ssize_t written = real(file, from, size);
    if (now != PASS) die();
    return written;
}

#define WRITES_AT(name, offset_type)                                                                                           \
    ssize_t name(int file, const void *from, size_t size, offset_type offset) {                                                \
        REAL(ssize_t, #name, int, const void *, size_t, offset_type);                                                          \
        int now = counted(WRITE, counts && file_is_under(file));                                                               \
        if (now == REFUSE) return -1;                                                                                          \
        if (now == HALF) size /= 2;                                                                                            \
        ssize_t written = real(file, from, size, offset);                                                                      \
        if (now != PASS) die();                                                                                                \
        return written;                                                                                                        \
    }
WRITES_AT(pwrite, off_t)
WRITES_AT(pwrite64, off64_t)

ssize_t writev(int file, const struct iovec *from, int many) {
    REAL(ssize_t, "writev", int, const struct iovec *, int);
    int now = counted(WRITE, counts && file > 2 && file_is_under(file));
    if (now == REFUSE) return -1;
    ssize_t written = real(file, from, now == HALF ? many / 2 : many);
    if (now != PASS) die();
    return written;
}

#define COPIES(name, offset_type)                                                                                              \
    ssize_t name(int to, int from, offset_type *offset, size_t size) {                                                         \
        REAL(ssize_t, #name, int, int, offset_type *, size_t);                                                                 \
        AROUND(WRITE, counts && file_is_under(to), real(to, from, offset, size));                                              \
    }
COPIES(sendfile, off_t)
COPIES(sendfile64, off64_t)

int fsync(int file) {
    REAL(int, "fsync", int);
    AROUND(SYNC, counts && file_is_under(file), real(file));
}

int fdatasync(int file) {
    REAL(int, "fdatasync", int);
    AROUND(SYNC, counts && file_is_under(file), real(file));
}

int rename(const char *from, const char *to) {
    REAL(int, "rename", const char *, const char *);
    AROUND(RENAME, is_under(AT_FDCWD, from) || is_under(AT_FDCWD, to), real(from, to));
}

int renameat(int from_folder, const char *from, int to_folder, const char *to) {
    REAL(int, "renameat", int, const char *, int, const char *);
    AROUND(RENAME, is_under(from_folder, from) || is_under(to_folder, to), real(from_folder, from, to_folder, to));
}

int renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags) {
    REAL(int, "renameat2", int, const char *, int, const char *, unsigned);
    AROUND(RENAME, is_under(from_folder, from) || is_under(to_folder, to), real(from_folder, from, to_folder, to, flags));
}

int unlink(const char *path) {
    REAL(int, "unlink", const char *);
    AROUND(UNLINK, is_under(AT_FDCWD, path), real(path));
}

int unlinkat(int folder, const char *path, int flags) {
    REAL(int, "unlinkat", int, const char *, int);
    AROUND(UNLINK, is_under(folder, path), real(folder, path, flags));
}

int rmdir(const char *path) {
    REAL(int, "rmdir", const char *);
    AROUND(UNLINK, is_under(AT_FDCWD, path), real(path));
}

int mkdir(const char *path, mode_t mode) {
    REAL(int, "mkdir", const char *, mode_t);
    AROUND(MKDIR, is_under(AT_FDCWD, path), real(path, mode));
}

int mkdirat(int folder, const char *path, mode_t mode) {
    REAL(int, "mkdirat", int, const char *, mode_t);
    AROUND(MKDIR, is_under(folder, path), real(folder, path, mode));
}

#define CUTS(name, offset_type)                                                                                                \
    int name(int file, offset_type size) {                                                                                     \
        REAL(int, #name, int, offset_type);                                                                                    \
        AROUND(TRUNCATE, counts && file_is_under(file), real(file, size));                                                     \
    }
CUTS(ftruncate, off_t)
CUTS(ftruncate64, off64_t)

int link(const char *from, const char *to) {
    REAL(int, "link", const char *, const char *);
    AROUND(LINK, is_under(AT_FDCWD, to), real(from, to));
}

int linkat(int from_folder, const char *from, int to_folder, const char *to, int flags) {
    REAL(int, "linkat", int, const char *, int, const char *, int);
    AROUND(LINK, is_under(to_folder, to), real(from_folder, from, to_folder, to, flags));
}

int symlink(const char *from, const char *to) {
    REAL(int, "symlink", const char *, const char *);
    AROUND(LINK, is_under(AT_FDCWD, to), real(from, to));
}

int symlinkat(const char *from, int folder, const char *to) {
    REAL(int, "symlinkat", const char *, int, const char *);
    AROUND(LINK, is_under(folder, to), real(from, folder, to));
}
