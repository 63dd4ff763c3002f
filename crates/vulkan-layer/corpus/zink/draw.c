/* Draws with OpenGL shaders, so that zink makes SPIR-V of them: see ../make.sh. */
#define GL_GLEXT_PROTOTYPES
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <GL/glext.h>
#include <stdio.h>
#include <stdlib.h>

/* Vertex and fragment shader. */
static const char *programs[][2] = {
    {"#version 430\n"
     "out Handed { vec4 colour; vec2 uv[2]; mat2 turn; } handed;\n"
     "void main() {\n"
     "    handed.colour = vec4(gl_VertexID); handed.uv[0] = vec2(gl_InstanceID);\n"
     "    handed.uv[1] = vec2(0.5); handed.turn = mat2(gl_InstanceID);\n"
     "    gl_Position = vec4(gl_VertexID & 1, gl_VertexID >> 1, 0.5, 1.0);\n"
     "}",
     "#version 430\n"
     "in Handed { vec4 colour; vec2 uv[2]; mat2 turn; } handed;\n"
     "out vec4 result;\n"
     "void main() {\n"
     "    if (handed.colour.r > 2.0) discard;\n"
     "    result = handed.colour + (handed.turn * handed.uv[1]).xyxy;\n"
     "}"},
    {"#version 430\n"
     "flat out int a; out vec3 b; out float c; out float gl_ClipDistance[2];\n"
     "void main() {\n"
     "    a = gl_InstanceID; b = vec3(1.0); c = 0.5; gl_ClipDistance[1] = 1.0;\n"
     "    gl_Position = vec4(gl_VertexID & 1, gl_VertexID >> 1, 0.5, 1.0);\n"
     "}",
     "#version 430\n"
     "flat in int a; in vec3 b; in float c;\n"
     "layout(location = 0) out vec4 first; layout(location = 1) out vec4 second;\n"
     "void main() {\n"
     "    first = vec4(b, c); second = vec4(a); gl_FragDepth = gl_FragCoord.z * 0.5;\n"
     "}"},
    {"#version 430\n"
     "out vec4 colour;\n"
     "void main() { colour = vec4(1.0); gl_Position = vec4(gl_VertexID & 1, gl_VertexID >> 1, 0.5, 1.0); }",
     "#version 430\n"
     "in vec4 colour;\n"
     "out vec4 result;\n"
     "void main() { result = colour; gl_SampleMask[0] = gl_SampleMaskIn[0] & 5; }"},
    {"#version 430\n"
     "sample out vec4 colour;\n"
     "void main() { colour = vec4(1.0); gl_Position = vec4(gl_VertexID & 1, gl_VertexID >> 1, 0.5, 1.0); }",
     "#version 430\n"
     "sample in vec4 colour;\n"
     "out vec4 result;\n"
     "void main() { result = colour * (gl_SampleID + 1) + gl_SamplePosition.xyxy; }"},
    {"#version 430\n"
     "void main() { gl_Position = vec4(gl_VertexID & 1, gl_VertexID >> 1, 0.5, 1.0); }",
     "#version 430\n"
     "layout(early_fragment_tests) in;\n"
     "layout(location = 0, index = 0) out vec4 result; layout(location = 0, index = 1) out vec4 factor;\n"
     "void main() { result = vec4(gl_PrimitiveID, gl_FrontFacing, gl_PointCoord); factor = vec4(0.5); }"},
    {"#version 430\n"
     "void main() { gl_Position = vec4(gl_VertexID & 1, gl_VertexID >> 1, 0.5, 1.0); }",
     "#version 430\n"
     "out vec4 results[2];\n"
     "void main() { results[0] = vec4(1.0); results[1] = vec4(0.5); }"},
};

static GLuint shader(GLenum kind, const char *source) {
    GLuint shader = glCreateShader(kind);
    glShaderSource(shader, 1, &source, NULL);
    glCompileShader(shader);
    return shader;
}

int main(void) {
    PFNEGLGETPLATFORMDISPLAYEXTPROC display_of = (void *)eglGetProcAddress("eglGetPlatformDisplayEXT");
    EGLDisplay display = display_of(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    EGLint major, minor, n;
    EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION, 4, EGL_CONTEXT_MINOR_VERSION, 3, EGL_NONE};
    EGLConfig config;
    if (!eglInitialize(display, &major, &minor) || !eglBindAPI(EGL_OPENGL_API) ||
        !eglChooseConfig(display, wanted, &config, 1, &n))
        return 1;
    EGLContext context = eglCreateContext(display, config, NULL, version);
    if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) return 1;
    fprintf(stderr, "%s\n", (const char *)glGetString(GL_RENDERER));

    GLuint array, frame, targets[3];
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    glGenFramebuffers(1, &frame);
    glBindFramebuffer(GL_FRAMEBUFFER, frame);
    glGenRenderbuffers(3, targets);
    for (int i = 0; i < 3; i++) {
        glBindRenderbuffer(GL_RENDERBUFFER, targets[i]);
        glRenderbufferStorageMultisample(GL_RENDERBUFFER, 4, i == 2 ? GL_DEPTH_COMPONENT32F : GL_RGBA8, 64, 64);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, i == 2 ? GL_DEPTH_ATTACHMENT : GL_COLOR_ATTACHMENT0 + i,
                                  GL_RENDERBUFFER, targets[i]);
    }
    glViewport(0, 0, 64, 64);
    for (size_t i = 0; i < sizeof programs / sizeof *programs; i++) {
        GLenum both[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
        /* Two colours for blending allow one target. */
        glDrawBuffers(i == 4 ? 1 : 2, both);
        GLuint program = glCreateProgram();
        glAttachShader(program, shader(GL_VERTEX_SHADER, programs[i][0]));
        glAttachShader(program, shader(GL_FRAGMENT_SHADER, programs[i][1]));
        glLinkProgram(program);
        GLint linked;
        glGetProgramiv(program, GL_LINK_STATUS, &linked);
        if (!linked) {
            char log[4096];
            glGetProgramInfoLog(program, sizeof log, NULL, log);
            fprintf(stderr, "%zu: %s\n", i, log);
            return 1;
        }
        glUseProgram(program);
        glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, 2);
        glFinish();
    }
    return 0;
}
