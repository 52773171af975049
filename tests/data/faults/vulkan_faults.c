// An implicit Vulkan layer that lets calls fail; see README.md. What it needs of Vulkan's ABI is declared here, so that no headers are needed.
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void (*Function)(void);
typedef Function (*GetProc)(void *object, const char *name);

enum { ERROR_INITIALIZATION_FAILED = -3, LOADER_INSTANCE_CREATE_INFO = 47, LOADER_DEVICE_CREATE_INFO = 48 };

// VkLayerInstanceLink, VkLayerDeviceLink
struct Link {
    struct Link *next;
    GetProc instance_proc, device_proc;
};

// VkLayerInstanceCreateInfo, VkLayerDeviceCreateInfo; `function` 0 has the link.
struct CreateInfo {
    int32_t type;
    struct CreateInfo *next;
    int32_t function;
    struct Link *link;
};

// VkNegotiateLayerInterface
struct Negotiate {
    int32_t type;
    void *next;
    uint32_t version;
    GetProc instance_proc, device_proc, physical_device_proc;
};

// Calls that may fail, with their parameters and these as arguments.
#define CALLS(X)                                                                                                               \
    X(vkQueueSubmit, (void *q, uint32_t n, const void *s, void *f), (q, n, s, f))                                              \
    X(vkWaitSemaphores, (void *d, const void *i, uint64_t t), (d, i, t))                                                       \
    X(vkWaitForFences, (void *d, uint32_t n, const void *f, uint32_t all, uint64_t t), (d, n, f, all, t))                      \
    X(vkAllocateMemory, (void *d, const void *i, const void *a, void *m), (d, i, a, m))                                        \
    X(vkMapMemory, (void *d, uint64_t m, uint64_t o, uint64_t s, uint32_t f, void *p), (d, m, o, s, f, p))                     \
    X(vkCreateBuffer, (void *d, const void *i, const void *a, void *b), (d, i, a, b))                                          \
    X(vkCreateImage, (void *d, const void *i, const void *a, void *m), (d, i, a, m))                                           \
    X(vkCreateComputePipelines, (void *d, uint64_t c, uint32_t n, const void *i, const void *a, void *p), (d, c, n, i, a, p))

static GetProc instance_proc, device_proc;
static void *instance;

// Which call is to fail, how, and after how many.
static char faulty[64];
static long after;
static int result, sticky;

__attribute__((constructor)) static void read_fault(void) {
    const char *fault = getenv("ABBE_FAULT");
    if (fault && sscanf(fault, "%63[^:]:%ld:%d:%d", faulty, &after, &result, &sticky) != 4) {
        fprintf(stderr, "ABBE_FAULT=%s is not CALL:N:RESULT:STICKY\n", fault);
        abort();
    }
}

// The VkResult that this call of `name` is to fail with, or 0.
static int fault(const char *name, long *count) {
    long before = __sync_fetch_and_add(count, 1);
    if (strcmp(name, faulty) || before < after || (before > after && !sticky))
        return 0;
    if (before == after)
        fprintf(stderr, "[fault: %s fails with %d]\n", name, result);
    return result;
}

// Each call's count, its next function down the chain, and what stands in its place.
#define DEFINE(name, parameters, arguments)                                                                                    \
    static long count_##name;                                                                                                  \
    static int(*next_##name) parameters;                                                                                       \
    static int our_##name parameters {                                                                                         \
        int failed = fault(#name, &count_##name);                                                                              \
        return failed ? failed : next_##name arguments;                                                                        \
    }
CALLS(DEFINE)
static long count_vkCreateDevice;

static struct Link *take_link(const void *info, int32_t type) {
    struct CreateInfo *at = ((const struct CreateInfo *)info)->next;
    while (at && !(at->type == type && at->function == 0))
        at = at->next;
    if (!at)
        return NULL;
    struct Link *link = at->link;
    at->link = link->next;
    return link;
}

static int create_instance(const void *info, const void *allocator, void **created) {
    struct Link *link = take_link(info, LOADER_INSTANCE_CREATE_INFO);
    if (!link)
        return ERROR_INITIALIZATION_FAILED;
    instance_proc = link->instance_proc;
    int (*next)(const void *, const void *, void **) = (void *)instance_proc(NULL, "vkCreateInstance");
    int done = next(info, allocator, created);
    instance = *created;
    return done;
}

static int create_device(void *physical, const void *info, const void *allocator, void **created) {
    struct Link *link = take_link(info, LOADER_DEVICE_CREATE_INFO);
    if (!link)
        return ERROR_INITIALIZATION_FAILED;
    int failed = fault("vkCreateDevice", &count_vkCreateDevice);
    if (failed)
        return failed;
    device_proc = link->device_proc;
    int (*next)(void *, const void *, const void *, void **) = (void *)link->instance_proc(instance, "vkCreateDevice");
    return next(physical, info, allocator, created);
}

static Function get_device_proc(void *device, const char *name) {
    Function next = device_proc(device, name);
    if (!strcmp(name, "vkGetDeviceProcAddr"))
        return (Function)get_device_proc;
    // The name with its extension's suffix is the same call.
#define REPLACE(call, parameters, arguments)                                                                                   \
    if (next && (!strcmp(name, #call) || !strcmp(name, #call "KHR"))) {                                                        \
        next_##call = (void *)next;                                                                                            \
        return (Function)our_##call;                                                                                           \
    }
    CALLS(REPLACE)
    return next;
}

static Function get_instance_proc(void *of, const char *name) {
    if (!strcmp(name, "vkCreateInstance"))
        return (Function)create_instance;
    if (!strcmp(name, "vkCreateDevice"))
        return (Function)create_device;
    if (!strcmp(name, "vkGetInstanceProcAddr"))
        return (Function)get_instance_proc;
    if (!strcmp(name, "vkGetDeviceProcAddr"))
        return (Function)get_device_proc;
    return instance_proc ? instance_proc(of, name) : NULL;
}

int vkNegotiateLoaderLayerInterfaceVersion(struct Negotiate *layer) {
    layer->version = 2;
    layer->instance_proc = get_instance_proc;
    layer->device_proc = get_device_proc;
    layer->physical_device_proc = NULL;
    return 0;
}

__attribute__((destructor)) static void write_counts(void) {
    const char *path = getenv("ABBE_FAULT_COUNTS");
    FILE *file = path ? fopen(path, "w") : NULL;
    if (!file)
        return;
#define WRITE(name, parameters, arguments) fprintf(file, #name " %ld\n", count_##name);
    CALLS(WRITE)
    fprintf(file, "vkCreateDevice %ld\n", count_vkCreateDevice);
    fclose(file);
}
