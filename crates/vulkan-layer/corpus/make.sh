#!/bin/sh
# Makes the modules in spv/ of the sources beside this file. Nothing runs it but who changes them:
# compilers differ by version, and the tests are to see the same modules everywhere.
#
# Needs glslangValidator (12.0.0), spirv-as (SPIRV-Tools 2023.1), cargo with the registry (naga 30),
# a C compiler, and Mesa's zink and lavapipe (22.3.6). A module's name ends with the environment
# in which it is valid, as spirv-val has it.
set -eu
cd "$(dirname "$0")"
here=$(pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p spv
rm -f spv/*.spv

glsl() { # SOURCE ENVIRONMENT [OPTIONS]
    from=$1 valid_in=$2
    shift 2
    glslangValidator --quiet -V --target-env "${valid_in%spv*}" "$@" "$from" \
        -o "spv/$(basename "$from").$valid_in.spv"
}

for source in glsl/*; do
    case $source in
    # What needs a later version, or is the same in each.
    */half*.frag | */shading_rate.* | */per_vertex.frag | */interlock.frag | */nothing.* | \
        */doubles.vert | */members.vert | */block_array.vert | */specialized.vert | \
        */feedback.vert | */clip.frag | */subpass.frag) environments=vulkan1.0 ;;
    */memory_model.frag | */device_scope.frag) environments=vulkan1.3 ;;
    *) environments="vulkan1.0 vulkan1.3" ;;
    esac
    for environment in $environments; do glsl "$source" "$environment"; done
done
for source in plain.frag plain.vert discard.frag mask.frag address.frag; do
    glsl glsl/$source vulkan1.1
    glsl glsl/$source vulkan1.2
    glsl glsl/$source vulkan1.1spv1.4 --target-env spirv1.4
done

# Debug information: OpLine, and instructions of a set that means nothing to the shader.
debug() { # NAME OPTION
    glslangValidator --quiet -V --target-env vulkan1.3 "$2" glsl/discard.frag \
        -o "spv/$1.frag.vulkan1.3.spv"
    glslangValidator --quiet -V --target-env vulkan1.3 "$2" glsl/block.vert \
        -o "spv/$1.vert.vulkan1.3.spv"
}
debug lines -g
debug debug_info -gVS

for source in hlsl/*.frag.hlsl hlsl/*.vert.hlsl; do
    stage=$(basename "${source%.hlsl}")
    for environment in vulkan1.0 vulkan1.2; do
        glslangValidator --quiet -D -V --target-env $environment -e main -S "${stage#*.}" "$source" \
            -o "spv/hlsl_$stage.$environment.spv"
    done
done

for source in asm/*.spvasm; do
    spirv-as --target-env vulkan1.0 "$source" \
        -o "spv/asm_$(basename "$source" .spvasm).vulkan1.0.spv"
done

# naga, by a program of a few lines.
mkdir -p "$work/naga/src"
cat > "$work/naga/Cargo.toml" <<'END'
[package]
name = "naga-corpus"
version = "0.0.0"
edition = "2024"

[dependencies]
naga = { version = "30", features = ["wgsl-in", "spv-out"] }
END
cat > "$work/naga/src/main.rs" <<'END'
use naga::{back::spv, front::wgsl, valid};

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, source, minor, to] = &arguments[..] else { panic!("SOURCE MINOR TO") };
    let source = std::fs::read_to_string(source).unwrap();
    let module = wgsl::parse_str(&source).unwrap();
    let (flags, capabilities) = (valid::ValidationFlags::all(), valid::Capabilities::all());
    let info = valid::Validator::new(flags, capabilities).validate(&module).unwrap();
    let options = spv::Options { lang_version: (1, minor.parse().unwrap()), ..Default::default() };
    let words = spv::write_vec(&module, &info, &options, None).unwrap();
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    std::fs::write(to, bytes).unwrap();
}
END
(cd "$work/naga" && cargo build --quiet)
naga=${CARGO_TARGET_DIR:-$work/naga/target}/debug/naga-corpus
for source in wgsl/*.wgsl; do
    name=$(basename "$source" .wgsl)
    "$naga" "$source" 0 "spv/naga_$name.vulkan1.0.spv"
    "$naga" "$source" 4 "spv/naga_$name.vulkan1.1spv1.4.spv"
done

# What zink makes of OpenGL shaders, which it writes where it is asked to.
cc -Wall zink/draw.c -o "$work/draw" -lEGL -lGL
mkdir "$work/zink"
(
    cd "$work/zink"
    LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_DRIVER=zink ZINK_DEBUG=spirv XDG_RUNTIME_DIR="$work" ../draw
)
for dump in "$work"/zink/dump*.spv; do
    n=${dump##*/dump}
    cp "$dump" "spv/zink_${n%.spv}.vulkan1.3.spv"
done
du -bc "$here"/spv/*.spv | tail -1
