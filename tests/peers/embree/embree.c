// The peer's half of run.sh: the rays of embree.rs by Embree 4, on one thread.
//
//   embree WORK
//
// WORK: vertices, triangles, directions, rays, side (u32), the least distance of a hit for rays from vertices (f32); position
// (3 f32) of each vertex; normal (3 f32) of each; three vertices of each triangle (u32); directions (3 f32); origin and
// direction (6 f32) of each ray; eye, direction to the image's upper left corner, step to the right, step down (12 f32).
// After a line that names the library, each line of standard input is answered by one:
//
//   build ROBUST                          a plain scene (0) or a robust one (1), which stays
//   bake ROBUST WIDTH COHERENT ORDER      occlusion from each vertex in each direction on its normal's side, by calls of
//                                         WIDTH (1, 8, 16) rays, all directions of a vertex (0) or all vertices of a
//                                         direction (1) after each other
//   nearest ROBUST WIDTH COHERENT         of the rays
//   primary ROBUST WIDTH COHERENT         of an image of side × side pixels
//   save FILE                             the last answers: a byte for each direction of each vertex, 1 if it is blocked,
//                                         0 if it is free, 2 if it is no ray; or distance (f32) and triangle (u32, all
//                                         ones for none) of each ray
//
// The wheel has no headers; what is declared here is from Embree 4's rtcore*.h.

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(holds) \
    do { \
        if (!(holds)) { \
            fprintf(stderr, "embree.c:%d: %s\n", __LINE__, #holds); \
            exit(1); \
        } \
    } while (0)

typedef struct Device *RTCDevice;
typedef struct Scene *RTCScene;
typedef struct Geometry *RTCGeometry;

// A packet of N rays, N = 1 too: the single ray has the same members, each once.
#define RAYS(N, ALIGN) \
    typedef struct __attribute__((aligned(ALIGN))) { \
        float org_x[N], org_y[N], org_z[N], tnear[N], dir_x[N], dir_y[N], dir_z[N], time[N], tfar[N]; \
        unsigned mask[N], id[N], flags[N]; \
    } RTCRay##N; \
    typedef struct __attribute__((aligned(ALIGN))) { \
        float Ng_x[N], Ng_y[N], Ng_z[N], u[N], v[N]; \
        unsigned primID[N], geomID[N], instID[N], instPrimID[N]; \
    } RTCHit##N; \
    typedef struct __attribute__((aligned(ALIGN))) { \
        RTCRay##N ray; \
        RTCHit##N hit; \
    } RTCRayHit##N;

RAYS(1, 16)
RAYS(8, 32)
RAYS(16, 64)

// RTCIntersectArguments and RTCOccludedArguments.
typedef struct {
    unsigned flags, feature_mask;
    void *context, *filter, *function;
    float min_width; // in builds with RTC_MIN_WIDTH
} Arguments;

enum { INDEX = 0, VERTEX = 1, UINT3 = 0x5003, FLOAT3 = 0x9003, TRIANGLE = 0, HIGH = 2, ROBUST = 4, COHERENT = 1 << 16, NONE = -1 };

RTCDevice rtcNewDevice(const char *);
int rtcGetDeviceError(RTCDevice);
ptrdiff_t rtcGetDeviceProperty(RTCDevice, int);
RTCScene rtcNewScene(RTCDevice);
void rtcSetSceneFlags(RTCScene, int);
void rtcSetSceneBuildQuality(RTCScene, int);
void rtcCommitScene(RTCScene);
void rtcReleaseScene(RTCScene);
RTCGeometry rtcNewGeometry(RTCDevice, int);
void *rtcSetNewGeometryBuffer(RTCGeometry, int, unsigned, int, size_t, size_t);
void rtcSetGeometryBuildQuality(RTCGeometry, int);
void rtcCommitGeometry(RTCGeometry);
unsigned rtcAttachGeometry(RTCScene, RTCGeometry);
void rtcReleaseGeometry(RTCGeometry);
void rtcIntersect1(RTCScene, RTCRayHit1 *, Arguments *);
void rtcIntersect8(const int *, RTCScene, RTCRayHit8 *, Arguments *);
void rtcIntersect16(const int *, RTCScene, RTCRayHit16 *, Arguments *);
void rtcOccluded1(RTCScene, RTCRay1 *, Arguments *);
void rtcOccluded8(const int *, RTCScene, RTCRay8 *, Arguments *);
void rtcOccluded16(const int *, RTCScene, RTCRay16 *, Arguments *);

typedef struct {
    float distance;
    unsigned triangle;
} Hit;

static unsigned vertices, triangles, directions, rays, side;
static float least;
static float (*positions)[3], (*normals)[3], (*ways)[3], (*wanted)[6], view[4][3];
static unsigned (*corners)[3];
static uint8_t *blocked;
static Hit *hits;
static RTCScene scenes[2], scene;
static Arguments arguments = {0, 0xffffffff, NULL, NULL, NULL, 0};

static void *read_items(FILE *file, size_t size, size_t count) {
    void *items = malloc(size * count + 1);
    CHECK(items && fread(items, size, count, file) == count);
    return items;
}

static void build(RTCDevice device, int robust) {
    if (scenes[robust]) rtcReleaseScene(scenes[robust]);
    RTCScene scene = scenes[robust] = rtcNewScene(device);
    rtcSetSceneFlags(scene, robust ? ROBUST : 0);
    rtcSetSceneBuildQuality(scene, HIGH);
    RTCGeometry geometry = rtcNewGeometry(device, TRIANGLE);
    rtcSetGeometryBuildQuality(geometry, HIGH);
    memcpy(rtcSetNewGeometryBuffer(geometry, VERTEX, 0, FLOAT3, 12, vertices), positions, 12 * (size_t)vertices);
    memcpy(rtcSetNewGeometryBuffer(geometry, INDEX, 0, UINT3, 12, triangles), corners, 12 * (size_t)triangles);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
}

#define SET(packet, lane, origin, way, near) \
    do { \
        (packet)->org_x[lane] = (origin)[0]; \
        (packet)->org_y[lane] = (origin)[1]; \
        (packet)->org_z[lane] = (origin)[2]; \
        (packet)->dir_x[lane] = (way)[0]; \
        (packet)->dir_y[lane] = (way)[1]; \
        (packet)->dir_z[lane] = (way)[2]; \
        (packet)->tnear[lane] = (near); \
        (packet)->tfar[lane] = __builtin_inff(); \
        (packet)->time[lane] = 0; \
        (packet)->mask[lane] = 0xffffffff; \
        (packet)->flags[lane] = 0; \
    } while (0)

#define CALL1(name, packet, count) name##1(scene, packet, &arguments)
#define CALL8(name, packet, count) name##8(masks[count], scene, packet, &arguments)
#define CALL16(name, packet, count) name##16(masks[count], scene, packet, &arguments)

// masks[n]: the first n lanes take part.
static int masks[17][16] __attribute__((aligned(64)));

// Rays from vertices are put together N by N, also from one vertex or direction to the next.
#define TRACE(N) \
    static void bake##N(int order) { \
        RTCRay##N packet; \
        uint8_t *answers[N]; \
        unsigned count = 0; \
        unsigned outer = order ? directions : vertices, inner = order ? vertices : directions; \
        for (unsigned a = 0; a < outer; a++) { \
            for (unsigned b = 0; b < inner; b++) { \
                unsigned vertex = order ? b : a, direction = order ? a : b; \
                const float *n = normals[vertex], *w = ways[direction]; \
                uint8_t *answer = &blocked[(size_t)vertex * directions + direction]; \
                if (!(n[0] * w[0] + n[1] * w[1] + n[2] * w[2] > 0)) { \
                    *answer = 2; \
                    continue; \
                } \
                SET(&packet, count, positions[vertex], w, least); \
                answers[count++] = answer; \
                if (count == N) { \
                    CALL##N(rtcOccluded, &packet, N); \
                    for (unsigned lane = 0; lane < N; lane++) *answers[lane] = packet.tfar[lane] < 0; \
                    count = 0; \
                } \
            } \
        } \
        if (count) CALL##N(rtcOccluded, &packet, count); \
        for (unsigned lane = 0; lane < count; lane++) *answers[lane] = packet.tfar[lane] < 0; \
    } \
    static void find##N(RTCRayHit##N *packet, unsigned count, const unsigned *which) { \
        for (unsigned lane = 0; lane < count; lane++) packet->hit.geomID[lane] = packet->hit.primID[lane] = NONE; \
        CALL##N(rtcIntersect, packet, count); \
        for (unsigned lane = 0; lane < count; lane++) \
            hits[which[lane]] = (Hit){packet->ray.tfar[lane], packet->hit.primID[lane]}; \
    } \
    static void nearest##N(void) { \
        RTCRayHit##N packet; \
        unsigned which[N]; \
        for (unsigned first = 0; first < rays; first += N) { \
            unsigned count = rays - first < N ? rays - first : N; \
            for (unsigned lane = 0; lane < count; lane++) { \
                SET(&packet.ray, lane, wanted[first + lane], wanted[first + lane] + 3, 0); \
                which[lane] = first + lane; \
            } \
            find##N(&packet, count, which); \
        } \
    } \
    /* A packet is a block of 4 × 2 or 4 × 4 pixels. */ \
    static void primary##N(void) { \
        const unsigned wide = N == 1 ? 1 : 4, high = N / wide; \
        RTCRayHit##N packet; \
        unsigned which[N]; \
        for (unsigned top = 0; top < side; top += high) { \
            for (unsigned left = 0; left < side; left += wide) { \
                for (unsigned lane = 0; lane < N; lane++) { \
                    unsigned x = left + lane % wide, y = top + lane / wide; \
                    float way[3]; \
                    for (int axis = 0; axis < 3; axis++) \
                        way[axis] = view[1][axis] + (x + 0.5f) * view[2][axis] + (y + 0.5f) * view[3][axis]; \
                    SET(&packet.ray, lane, view[0], way, 0); \
                    which[lane] = side * y + x; \
                } \
                find##N(&packet, N, which); \
            } \
        } \
    }

TRACE(1)
TRACE(8)
TRACE(16)

int main(int count, char **texts) {
    CHECK(count == 2);
    FILE *file = fopen(texts[1], "rb");
    CHECK(file);
    unsigned *counts = read_items(file, 4, 5);
    vertices = counts[0], triangles = counts[1], directions = counts[2], rays = counts[3], side = counts[4];
    least = *(float *)read_items(file, 4, 1);
    positions = read_items(file, 12, vertices);
    normals = read_items(file, 12, vertices);
    corners = read_items(file, 12, triangles);
    ways = read_items(file, 12, directions);
    wanted = read_items(file, 24, rays);
    memcpy(view, read_items(file, 48, 1), 48);
    fclose(file);
    CHECK(side % 4 == 0);
    for (int first = 0; first < 17; first++)
        for (int lane = 0; lane < first; lane++) masks[first][lane] = -1;
    blocked = calloc((size_t)vertices * directions + 1, 1);
    hits = calloc((rays > side * side ? rays : side * side) + 1, sizeof *hits);
    CHECK(blocked && hits);

    RTCDevice device = rtcNewDevice("threads=1");
    CHECK(device);
    ptrdiff_t version = rtcGetDeviceProperty(device, 0);
    printf("Embree %td.%td.%td\n", version / 10000, version / 100 % 100, version % 100);
    fflush(stdout);

    char line[4096], word[4096];
    int last = 0;
    while (fgets(line, sizeof line, stdin)) {
        int robust = 0, width = 0, coherent = 0, order = 0;
        CHECK(sscanf(line, "%4095s %d %d %d %d", word, &robust, &width, &coherent, &order) >= 1);
        if (robust == 0 || robust == 1) scene = scenes[robust];
        CHECK(scene || !strcmp(word, "build"));
        arguments.flags = coherent ? COHERENT : 0;
        if (!strcmp(word, "build")) {
            build(device, robust);
        } else if (!strcmp(word, "bake")) {
            (width == 1 ? bake1 : width == 8 ? bake8 : bake16)(order);
            last = 0;
        } else if (!strcmp(word, "nearest")) {
            (width == 1 ? nearest1 : width == 8 ? nearest8 : nearest16)();
            last = 1;
        } else if (!strcmp(word, "primary")) {
            (width == 1 ? primary1 : width == 8 ? primary8 : primary16)();
            last = 2;
        } else {
            CHECK(!strcmp(word, "save") && strlen(line) > 6);
            line[strcspn(line, "\n")] = 0;
            CHECK((file = fopen(line + 5, "wb")));
            size_t items = last == 0 ? (size_t)vertices * directions : last == 1 ? rays : (size_t)side * side;
            const void *answers = last == 0 ? (void *)blocked : (void *)hits;
            CHECK(fwrite(answers, last == 0 ? 1 : sizeof *hits, items, file) == items);
            CHECK(fclose(file) == 0);
        }
        CHECK(rtcGetDeviceError(device) == 0);
        printf("done\n");
        fflush(stdout);
    }
    return 0;
}
