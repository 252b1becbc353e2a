// The peer's half of run.sh: depth, position and normal of a mesh by OpenGL 4.5, without a window.
//
//   llvmpipe MESH
//
// MESH: width, height, vertices, triangles (u32); the rows of the matrix from the world to clip coordinates (16 f32, depth
// near / w); position and normal of each vertex (6 f32); three vertices of each triangle (u32). After a line that names
// the renderer, each line of standard input is answered by one: a number of frames when they are finished, the name of a
// file when it holds the last frame: depths, positions (4 f32), normals (4 f32), the top row first.

#define GL_GLEXT_PROTOTYPES
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <GL/glext.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(holds) \
    do { \
        if (!(holds)) { \
            fprintf(stderr, "llvmpipe.c:%d: %s\n", __LINE__, #holds); \
            exit(1); \
        } \
    } while (0)

static const char *VERTEX = "#version 450 core\n"
                            "layout(location = 0) in vec3 position;\n"
                            "layout(location = 1) in vec3 normal;\n"
                            "layout(location = 0) uniform mat4 clip_from_world;\n"
                            "layout(location = 0) out vec3 p;\n"
                            "layout(location = 1) out vec3 n;\n"
                            "void main() {\n"
                            "    gl_Position = clip_from_world * vec4(position, 1);\n"
                            "    p = position;\n"
                            "    n = normal;\n"
                            "}\n";

static const char *FRAGMENT = "#version 450 core\n"
                              "layout(location = 0) in vec3 p;\n"
                              "layout(location = 1) in vec3 n;\n"
                              "layout(location = 0) out vec4 position;\n"
                              "layout(location = 1) out vec4 normal;\n"
                              "void main() {\n"
                              "    position = vec4(p, 1);\n"
                              "    normal = vec4(normalize(n), 0);\n"
                              "}\n";

static void *read_items(FILE *file, size_t size, size_t count) {
    void *items = malloc(size * count);
    CHECK(items && fread(items, size, count, file) == count);
    return items;
}

static void attach_shader(GLuint program, GLenum kind, const char *text) {
    GLuint shader = glCreateShader(kind);
    GLint compiled = 0;
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    CHECK(compiled);
    glAttachShader(program, shader);
}

static void attach_image(GLenum attachment, GLenum format, GLsizei width, GLsizei height) {
    GLuint image;
    glGenTextures(1, &image);
    glBindTexture(GL_TEXTURE_2D, image);
    glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
    glFramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, image, 0);
}

static void make_context(void) {
    PFNEGLGETPLATFORMDISPLAYEXTPROC get_display =
        (PFNEGLGETPLATFORMDISPLAYEXTPROC)eglGetProcAddress("eglGetPlatformDisplayEXT");
    CHECK(get_display);
    EGLDisplay display = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    CHECK(eglInitialize(display, NULL, NULL) && eglBindAPI(EGL_OPENGL_API));
    EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 4, EGL_CONTEXT_MINOR_VERSION, 5,
                           EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    CHECK(context != EGL_NO_CONTEXT && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context));
}

static void write_image(FILE *file, GLenum attachment, GLenum format, size_t channels, const GLuint *size) {
    size_t count = channels * size[0] * size[1];
    float *values = malloc(count * sizeof *values);
    CHECK(values);
    if (attachment) glReadBuffer(attachment);
    glReadPixels(0, 0, size[0], size[1], format, GL_FLOAT, values);
    CHECK(fwrite(values, sizeof *values, count, file) == count);
    free(values);
}

int main(int count, char **arguments) {
    CHECK(count == 2);
    FILE *file = fopen(arguments[1], "rb");
    CHECK(file);
    GLuint *size = read_items(file, 4, 4); // width, height, vertices, triangles
    float *matrix = read_items(file, 4, 16);
    float *vertices = read_items(file, 24, size[2]);
    GLuint *triangles = read_items(file, 12, size[3]);
    fclose(file);

    make_context();
    GLuint objects[2], array, framebuffer, program = glCreateProgram();
    glGenBuffers(2, objects);
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    glBindBuffer(GL_ARRAY_BUFFER, objects[0]);
    glBufferData(GL_ARRAY_BUFFER, 24 * (GLsizeiptr)size[2], vertices, GL_STATIC_DRAW);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, objects[1]);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, 12 * (GLsizeiptr)size[3], triangles, GL_STATIC_DRAW);
    for (GLuint attribute = 0; attribute < 2; attribute++) {
        glEnableVertexAttribArray(attribute);
        glVertexAttribPointer(attribute, 3, GL_FLOAT, GL_FALSE, 24, (const char *)NULL + 12 * attribute);
    }
    attach_shader(program, GL_VERTEX_SHADER, VERTEX);
    attach_shader(program, GL_FRAGMENT_SHADER, FRAGMENT);
    glLinkProgram(program);
    glUseProgram(program);
    glUniformMatrix4fv(0, 1, GL_TRUE, matrix);

    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    attach_image(GL_COLOR_ATTACHMENT0, GL_RGBA32F, size[0], size[1]);
    attach_image(GL_COLOR_ATTACHMENT1, GL_RGBA32F, size[0], size[1]);
    attach_image(GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, size[0], size[1]);
    glDrawBuffers(2, (GLenum[]){GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1});
    CHECK(glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE);
    glViewport(0, 0, size[0], size[1]);
    glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE); // row 0 is the top
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glClearDepth(0);
    printf("%s, OpenGL %s\n", (const char *)glGetString(GL_RENDERER), (const char *)glGetString(GL_VERSION));
    fflush(stdout);

    char line[4096];
    while (fgets(line, sizeof line, stdin)) {
        line[strcspn(line, "\n")] = 0;
        int frames = atoi(line);
        for (int frame = 0; frame < frames; frame++) {
            glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
            glDrawElements(GL_TRIANGLES, 3 * (GLsizei)size[3], GL_UNSIGNED_INT, NULL);
            glFinish();
        }
        if (frames == 0) {
            CHECK((file = fopen(line, "wb")));
            write_image(file, 0, GL_DEPTH_COMPONENT, 1, size);
            write_image(file, GL_COLOR_ATTACHMENT0, GL_RGBA, 4, size);
            write_image(file, GL_COLOR_ATTACHMENT1, GL_RGBA, 4, size);
            CHECK(fclose(file) == 0);
        }
        CHECK(glGetError() == GL_NO_ERROR);
        printf("done\n");
        fflush(stdout);
    }
    return 0;
}
