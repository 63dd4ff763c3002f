/* Draws triangles with Direct3D 12, has the pixel shader record its fragments, and writes them
 * as a trace. Without a window; any device of feature level 11.0 does.
 *
 *     dxc -T vs_6_0 -E corner -I <folder of append.hlsl> triangles.hlsl -Fo corner.dxil
 *     dxc -T ps_6_0 -E record -I <folder of append.hlsl> triangles.hlsl -Fo record.dxil
 *     cl /EHsc /I<folder of screendoor_trace.h> direct3d.cpp d3d12.lib dxgi.lib
 *     direct3d corner.dxil record.dxil direct3d.arrow
 */
#define SCREENDOOR_TRACE_IMPLEMENTATION
#include "screendoor_trace.h"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <d3d12.h>
#include <vector>

static const UINT WIDTH = 320, HEIGHT = 240, SAMPLES = 4;

/* A corner: its place in clip space, and its colour, linear and not multiplied by alpha. */
struct Corner {
    float place[4], colour[4];
};

static const Corner FAN[] = {
    {{-0.9f, -0.8f, 0.20f, 1}, {0.9f, 0.1f, 0.05f, 0.6f}},
    {{0.5f, -0.7f, 0.70f, 1}, {0.9f, 0.1f, 0.05f, 0.6f}},
    {{-0.2f, 0.9f, 0.40f, 1}, {0.9f, 0.1f, 0.05f, 0.6f}},
    {{-0.6f, -0.9f, 0.60f, 1}, {0.05f, 0.3f, 0.9f, 0.5f}},
    {{0.9f, -0.5f, 0.20f, 1}, {0.05f, 0.3f, 0.9f, 0.5f}},
    {{0.1f, 0.8f, 0.50f, 1}, {0.05f, 0.3f, 0.9f, 0.5f}},
    {{-0.8f, 0.5f, 0.45f, 1}, {0.1f, 0.8f, 0.1f, 0.4f}},
    {{0.8f, 0.4f, 0.45f, 1}, {0.1f, 0.8f, 0.1f, 0.4f}},
    {{0.0f, -0.9f, 0.45f, 1}, {0.1f, 0.8f, 0.1f, 0.4f}},
};

static void fail(const char *what) {
    std::fprintf(stderr, "direct3d: %s\n", what);
    std::exit(1);
}

static void check(HRESULT result, const char *what) {
    if (FAILED(result)) fail(what);
}

static std::vector<char> contents(const char *path) {
    std::FILE *file = std::fopen(path, "rb");
    if (!file || std::fseek(file, 0, SEEK_END)) fail(path);
    std::vector<char> all(static_cast<size_t>(std::ftell(file)));
    std::rewind(file);
    if (std::fread(all.data(), 1, all.size(), file) != all.size()) fail(path);
    std::fclose(file);
    return all;
}

static ID3D12Device *device;
static ID3D12CommandQueue *queue;

static ID3D12Resource *make_buffer(
    UINT64 bytes, D3D12_HEAP_TYPE heap, D3D12_RESOURCE_FLAGS flags, D3D12_RESOURCE_STATES state) {
    D3D12_HEAP_PROPERTIES where = {};
    where.Type = heap;
    D3D12_RESOURCE_DESC what = {};
    what.Dimension = D3D12_RESOURCE_DIMENSION_BUFFER, what.Width = bytes;
    what.Height = what.DepthOrArraySize = what.MipLevels = 1;
    what.SampleDesc.Count = 1, what.Layout = D3D12_TEXTURE_LAYOUT_ROW_MAJOR, what.Flags = flags;
    ID3D12Resource *made = nullptr;
    check(device->CreateCommittedResource(
              &where, D3D12_HEAP_FLAG_NONE, &what, state, nullptr, IID_PPV_ARGS(&made)),
        "a buffer cannot be made");
    return made;
}

/* A buffer that the device reads, with these bytes. */
static ID3D12Resource *filled(const void *data, size_t bytes) {
    ID3D12Resource *made = make_buffer(bytes, D3D12_HEAP_TYPE_UPLOAD, D3D12_RESOURCE_FLAG_NONE,
        D3D12_RESOURCE_STATE_GENERIC_READ);
    void *to = nullptr;
    const D3D12_RANGE nothing_read = {0, 0};
    check(made->Map(0, &nothing_read, &to), "a buffer cannot be written");
    std::memcpy(to, data, bytes);
    made->Unmap(0, nullptr);
    return made;
}

static D3D12_RESOURCE_BARRIER transition(
    ID3D12Resource *of, D3D12_RESOURCE_STATES before, D3D12_RESOURCE_STATES after) {
    D3D12_RESOURCE_BARRIER barrier = {};
    barrier.Type = D3D12_RESOURCE_BARRIER_TYPE_TRANSITION;
    barrier.Transition.pResource = of;
    barrier.Transition.Subresource = D3D12_RESOURCE_BARRIER_ALL_SUBRESOURCES;
    barrier.Transition.StateBefore = before, barrier.Transition.StateAfter = after;
    return barrier;
}

/* One table: the fragments' buffer, u0. Not as a root descriptor, which has no length. */
static ID3D12RootSignature *make_signature() {
    D3D12_DESCRIPTOR_RANGE range = {};
    range.RangeType = D3D12_DESCRIPTOR_RANGE_TYPE_UAV, range.NumDescriptors = 1;
    D3D12_ROOT_PARAMETER parameter = {};
    parameter.ParameterType = D3D12_ROOT_PARAMETER_TYPE_DESCRIPTOR_TABLE;
    parameter.DescriptorTable.NumDescriptorRanges = 1;
    parameter.DescriptorTable.pDescriptorRanges = &range;
    parameter.ShaderVisibility = D3D12_SHADER_VISIBILITY_PIXEL;
    D3D12_ROOT_SIGNATURE_DESC what = {};
    what.NumParameters = 1, what.pParameters = &parameter;
    what.Flags = D3D12_ROOT_SIGNATURE_FLAG_ALLOW_INPUT_ASSEMBLER_INPUT_LAYOUT;
    ID3DBlob *text = nullptr, *error = nullptr;
    check(D3D12SerializeRootSignature(&what, D3D_ROOT_SIGNATURE_VERSION_1, &text, &error),
        "a signature cannot be written");
    ID3D12RootSignature *signature = nullptr;
    check(device->CreateRootSignature(0, text->GetBufferPointer(), text->GetBufferSize(),
              IID_PPV_ARGS(&signature)),
        "a signature cannot be made");
    return signature;
}

/* Without a depth test and without culling: what they reject would not be recorded. */
static ID3D12PipelineState *make_pipeline(ID3D12RootSignature *signature, DXGI_FORMAT format,
    const std::vector<char> &corner, const std::vector<char> &record) {
    const D3D12_INPUT_ELEMENT_DESC elements[2] = {
        {"POSITION", 0, DXGI_FORMAT_R32G32B32A32_FLOAT, 0, 0,
            D3D12_INPUT_CLASSIFICATION_PER_VERTEX_DATA, 0},
        {"COLOR", 0, DXGI_FORMAT_R32G32B32A32_FLOAT, 0, 16,
            D3D12_INPUT_CLASSIFICATION_PER_VERTEX_DATA, 0}};
    D3D12_GRAPHICS_PIPELINE_STATE_DESC what = {};
    what.pRootSignature = signature;
    what.VS.pShaderBytecode = corner.data(), what.VS.BytecodeLength = corner.size();
    what.PS.pShaderBytecode = record.data(), what.PS.BytecodeLength = record.size();
    what.InputLayout.pInputElementDescs = elements, what.InputLayout.NumElements = 2;
    what.RasterizerState.FillMode = D3D12_FILL_MODE_SOLID;
    what.RasterizerState.CullMode = D3D12_CULL_MODE_NONE;
    what.RasterizerState.DepthClipEnable = TRUE;
    what.RasterizerState.MultisampleEnable = TRUE;
    what.SampleMask = UINT_MAX, what.SampleDesc.Count = SAMPLES;
    what.PrimitiveTopologyType = D3D12_PRIMITIVE_TOPOLOGY_TYPE_TRIANGLE;
    what.NumRenderTargets = 1, what.RTVFormats[0] = format;
    ID3D12PipelineState *pipeline = nullptr;
    check(device->CreateGraphicsPipelineState(&what, IID_PPV_ARGS(&pipeline)),
        "a pipeline cannot be made");
    return pipeline;
}

/* A colour target of several samples, in its own heap of one descriptor. */
static ID3D12DescriptorHeap *make_target(DXGI_FORMAT format) {
    D3D12_HEAP_PROPERTIES where = {};
    where.Type = D3D12_HEAP_TYPE_DEFAULT;
    D3D12_RESOURCE_DESC what = {};
    what.Dimension = D3D12_RESOURCE_DIMENSION_TEXTURE2D, what.Format = format;
    what.Width = WIDTH, what.Height = HEIGHT, what.DepthOrArraySize = what.MipLevels = 1;
    what.SampleDesc.Count = SAMPLES, what.Flags = D3D12_RESOURCE_FLAG_ALLOW_RENDER_TARGET;
    ID3D12Resource *target = nullptr;
    check(device->CreateCommittedResource(&where, D3D12_HEAP_FLAG_NONE, &what,
              D3D12_RESOURCE_STATE_RENDER_TARGET, nullptr, IID_PPV_ARGS(&target)),
        "a target cannot be made");
    D3D12_DESCRIPTOR_HEAP_DESC one = {};
    one.Type = D3D12_DESCRIPTOR_HEAP_TYPE_RTV, one.NumDescriptors = 1;
    ID3D12DescriptorHeap *heap = nullptr;
    check(device->CreateDescriptorHeap(&one, IID_PPV_ARGS(&heap)), "a target cannot be seen");
    device->CreateRenderTargetView(target, nullptr, heap->GetCPUDescriptorHandleForHeapStart());
    return heap;
}

int main(int argc, char **argv) {
    if (argc < 4) fail("usage: direct3d corner.dxil record.dxil TRACE");
    check(D3D12CreateDevice(nullptr, D3D_FEATURE_LEVEL_11_0, IID_PPV_ARGS(&device)),
        "there is no device");
    D3D12_COMMAND_QUEUE_DESC queue_info = {};
    check(device->CreateCommandQueue(&queue_info, IID_PPV_ARGS(&queue)), "no queue");
    const DXGI_FORMAT format = DXGI_FORMAT_R8G8B8A8_UNORM;
    ID3D12RootSignature *signature = make_signature();
    ID3D12PipelineState *pipeline =
        make_pipeline(signature, format, contents(argv[1]), contents(argv[2]));
    ID3D12DescriptorHeap *target = make_target(format);
    D3D12_DESCRIPTOR_HEAP_DESC table_info = {};
    table_info.Type = D3D12_DESCRIPTOR_HEAP_TYPE_CBV_SRV_UAV, table_info.NumDescriptors = 1;
    table_info.Flags = D3D12_DESCRIPTOR_HEAP_FLAG_SHADER_VISIBLE;
    ID3D12DescriptorHeap *table = nullptr;
    check(device->CreateDescriptorHeap(&table_info, IID_PPV_ARGS(&table)), "no table");
    ID3D12Resource *vertices = filled(FAN, sizeof FAN);
    const uint32_t zero = 0;
    ID3D12Resource *none = filled(&zero, sizeof zero);
    ID3D12Fence *fence = nullptr;
    check(device->CreateFence(0, D3D12_FENCE_FLAG_NONE, IID_PPV_ARGS(&fence)), "no fence");

    /* Draw, and again with a larger buffer where there were more fragments than it holds. */
    UINT capacity = 1 << 10, count = 0;
    ID3D12Resource *seen = nullptr;
    char *data = nullptr;
    for (UINT64 turn = 1;; turn++) {
        const UINT64 bytes = 4 + UINT64(capacity) * sizeof(screendoor_raw_fragment);
        ID3D12Resource *fragments = make_buffer(bytes, D3D12_HEAP_TYPE_DEFAULT,
            D3D12_RESOURCE_FLAG_ALLOW_UNORDERED_ACCESS, D3D12_RESOURCE_STATE_COMMON);
        seen = make_buffer(bytes, D3D12_HEAP_TYPE_READBACK, D3D12_RESOURCE_FLAG_NONE,
            D3D12_RESOURCE_STATE_COPY_DEST);
        D3D12_UNORDERED_ACCESS_VIEW_DESC words = {};
        words.Format = DXGI_FORMAT_R32_TYPELESS;
        words.ViewDimension = D3D12_UAV_DIMENSION_BUFFER;
        words.Buffer.NumElements = UINT(bytes / 4), words.Buffer.Flags = D3D12_BUFFER_UAV_FLAG_RAW;
        device->CreateUnorderedAccessView(
            fragments, nullptr, &words, table->GetCPUDescriptorHandleForHeapStart());

        ID3D12CommandAllocator *memory = nullptr;
        ID3D12GraphicsCommandList *draw = nullptr;
        const D3D12_COMMAND_LIST_TYPE direct = D3D12_COMMAND_LIST_TYPE_DIRECT;
        check(device->CreateCommandAllocator(direct, IID_PPV_ARGS(&memory)), "no commands");
        check(device->CreateCommandList(0, direct, memory, pipeline, IID_PPV_ARGS(&draw)),
            "no commands");
        const D3D12_RESOURCE_BARRIER barriers[3] = {
            transition(fragments, D3D12_RESOURCE_STATE_COMMON, D3D12_RESOURCE_STATE_COPY_DEST),
            transition(fragments, D3D12_RESOURCE_STATE_COPY_DEST,
                D3D12_RESOURCE_STATE_UNORDERED_ACCESS),
            transition(fragments, D3D12_RESOURCE_STATE_UNORDERED_ACCESS,
                D3D12_RESOURCE_STATE_COPY_SOURCE)};
        draw->ResourceBarrier(1, &barriers[0]);
        draw->CopyBufferRegion(fragments, 0, none, 0, sizeof zero); /* the count */
        draw->ResourceBarrier(1, &barriers[1]);
        const D3D12_VIEWPORT viewport = {0, 0, float(WIDTH), float(HEIGHT), 0, 1};
        const D3D12_RECT scissor = {0, 0, LONG(WIDTH), LONG(HEIGHT)};
        const D3D12_CPU_DESCRIPTOR_HANDLE to = target->GetCPUDescriptorHandleForHeapStart();
        const D3D12_VERTEX_BUFFER_VIEW corners = {
            vertices->GetGPUVirtualAddress(), sizeof FAN, sizeof(Corner)};
        draw->SetGraphicsRootSignature(signature);
        draw->SetDescriptorHeaps(1, &table);
        draw->SetGraphicsRootDescriptorTable(0, table->GetGPUDescriptorHandleForHeapStart());
        draw->RSSetViewports(1, &viewport);
        draw->RSSetScissorRects(1, &scissor);
        draw->OMSetRenderTargets(1, &to, FALSE, nullptr);
        draw->IASetPrimitiveTopology(D3D_PRIMITIVE_TOPOLOGY_TRIANGLELIST);
        draw->IASetVertexBuffers(0, 1, &corners);
        draw->DrawInstanced(sizeof FAN / sizeof(Corner), 1, 0, 0);
        draw->ResourceBarrier(1, &barriers[2]);
        draw->CopyResource(seen, fragments);
        check(draw->Close(), "it cannot be drawn");
        ID3D12CommandList *list = draw;
        queue->ExecuteCommandLists(1, &list);
        check(queue->Signal(fence, turn), "the device was lost");
        check(fence->SetEventOnCompletion(turn, nullptr), "the device was lost");
        draw->Release(), memory->Release(), fragments->Release();

        check(seen->Map(0, nullptr, reinterpret_cast<void **>(&data)), "nothing can be read");
        std::memcpy(&count, data, 4);
        if (count <= capacity) break;
        seen->Release();
        capacity = count;
    }

    screendoor_header header = {};
    header.width = WIDTH, header.height = HEIGHT, header.samples = SAMPLES;
    header.source = "triangles by Direct3D 12", header.camera = "clip space";
    std::vector<screendoor_raw_fragment> raw(count);
    std::memcpy(raw.data(), data + 4, count * sizeof(screendoor_raw_fragment));
    screendoor_trace *trace = screendoor_trace_open(argv[3], &header);
    screendoor_trace_push_raw(trace, raw.data(), count);
    if (!screendoor_trace_close(trace)) fail(screendoor_trace_error(trace));
    screendoor_trace_free(trace);
    std::printf("%s: %u fragments\n", argv[3], count);
    return 0;
}
