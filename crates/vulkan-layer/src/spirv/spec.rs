//! Numbers of the SPIR-V specification, by its own names.

/// Instructions.
pub(super) mod op {
    pub(crate) const SOURCE_CONTINUED: u32 = 2;
    pub(crate) const SOURCE: u32 = 3;
    pub(crate) const SOURCE_EXTENSION: u32 = 4;
    pub(crate) const NAME: u32 = 5;
    pub(crate) const MEMBER_NAME: u32 = 6;
    pub(crate) const STRING: u32 = 7;
    pub(crate) const LINE: u32 = 8;
    pub(crate) const EXTENSION: u32 = 10;
    pub(crate) const EXT_INST_IMPORT: u32 = 11;
    pub(crate) const EXT_INST: u32 = 12;
    pub(crate) const MEMORY_MODEL: u32 = 14;
    pub(crate) const ENTRY_POINT: u32 = 15;
    pub(crate) const EXECUTION_MODE: u32 = 16;
    pub(crate) const CAPABILITY: u32 = 17;
    pub(crate) const TYPE_VOID: u32 = 19;
    pub(crate) const TYPE_BOOL: u32 = 20;
    pub(crate) const TYPE_INT: u32 = 21;
    pub(crate) const TYPE_FLOAT: u32 = 22;
    pub(crate) const TYPE_VECTOR: u32 = 23;
    pub(crate) const TYPE_MATRIX: u32 = 24;
    pub(crate) const TYPE_ARRAY: u32 = 28;
    pub(crate) const TYPE_RUNTIME_ARRAY: u32 = 29;
    pub(crate) const TYPE_STRUCT: u32 = 30;
    pub(crate) const TYPE_POINTER: u32 = 32;
    pub(crate) const TYPE_FUNCTION: u32 = 33;
    pub(crate) const CONSTANT: u32 = 43;
    pub(crate) const FUNCTION: u32 = 54;
    pub(crate) const FUNCTION_END: u32 = 56;
    pub(crate) const FUNCTION_CALL: u32 = 57;
    pub(crate) const VARIABLE: u32 = 59;
    pub(crate) const LOAD: u32 = 61;
    pub(crate) const STORE: u32 = 62;
    pub(crate) const ACCESS_CHAIN: u32 = 65;
    pub(crate) const DECORATE: u32 = 71;
    pub(crate) const MEMBER_DECORATE: u32 = 72;
    pub(crate) const DECORATION_GROUP: u32 = 73;
    pub(crate) const GROUP_DECORATE: u32 = 74;
    pub(crate) const GROUP_MEMBER_DECORATE: u32 = 75;
    pub(crate) const VECTOR_SHUFFLE: u32 = 79;
    pub(crate) const COMPOSITE_CONSTRUCT: u32 = 80;
    pub(crate) const COMPOSITE_EXTRACT: u32 = 81;
    pub(crate) const COMPOSITE_INSERT: u32 = 82;
    pub(crate) const CONVERT_F_TO_U: u32 = 109;
    pub(crate) const F_CONVERT: u32 = 115;
    pub(crate) const BITCAST: u32 = 124;
    pub(crate) const LOGICAL_AND: u32 = 167;
    pub(crate) const LOGICAL_NOT: u32 = 168;
    pub(crate) const SELECT: u32 = 169;
    pub(crate) const I_NOT_EQUAL: u32 = 171;
    pub(crate) const U_LESS_THAN: u32 = 176;
    pub(crate) const SHIFT_LEFT_LOGICAL: u32 = 196;
    pub(crate) const BITWISE_OR: u32 = 197;
    pub(crate) const BITWISE_AND: u32 = 199;
    pub(crate) const D_PDX: u32 = 207;
    pub(crate) const D_PDY: u32 = 208;
    pub(crate) const ATOMIC_I_ADD: u32 = 234;
    pub(crate) const LOOP_MERGE: u32 = 246;
    pub(crate) const SELECTION_MERGE: u32 = 247;
    pub(crate) const LABEL: u32 = 248;
    pub(crate) const BRANCH: u32 = 249;
    pub(crate) const BRANCH_CONDITIONAL: u32 = 250;
    pub(crate) const SWITCH: u32 = 251;
    pub(crate) const KILL: u32 = 252;
    pub(crate) const RETURN: u32 = 253;
    pub(crate) const MODULE_PROCESSED: u32 = 330;
    pub(crate) const EXECUTION_MODE_ID: u32 = 331;
    pub(crate) const DECORATE_ID: u32 = 332;
    pub(crate) const TERMINATE_INVOCATION: u32 = 4416;
    pub(crate) const DEMOTE_TO_HELPER_INVOCATION: u32 = 5380;
    pub(crate) const IS_HELPER_INVOCATION: u32 = 5381;
    pub(crate) const DECORATE_STRING: u32 = 5632;
    pub(crate) const MEMBER_DECORATE_STRING: u32 = 5633;
}

/// Execution models.
pub(super) mod model {
    pub(crate) const VERTEX: u32 = 0;
    pub(crate) const FRAGMENT: u32 = 4;
}

/// Execution modes.
pub(super) mod mode {
    pub(crate) const EARLY_FRAGMENT_TESTS: u32 = 9;
    pub(crate) const EARLY_AND_LATE_FRAGMENT_TESTS: u32 = 5017;
}

/// Addressing and memory models.
pub(super) mod memory {
    pub(crate) const LOGICAL: u32 = 0;
    pub(crate) const PHYSICAL_STORAGE_BUFFER_64: u32 = 5348;
    pub(crate) const VULKAN: u32 = 3;
    /// Memory operand: the alignment follows.
    pub(crate) const ALIGNED: u32 = 2;
    pub(crate) const SCOPE_DEVICE: u32 = 1;
    pub(crate) const SCOPE_QUEUE_FAMILY: u32 = 5;
}

/// Storage classes.
pub(super) mod class {
    pub(crate) const INPUT: u32 = 1;
    pub(crate) const UNIFORM: u32 = 2;
    pub(crate) const OUTPUT: u32 = 3;
    pub(crate) const STORAGE_BUFFER: u32 = 12;
    pub(crate) const PHYSICAL_STORAGE_BUFFER: u32 = 5349;
}

/// Decorations.
pub(super) mod decoration {
    pub(crate) const BLOCK: u32 = 2;
    pub(crate) const BUFFER_BLOCK: u32 = 3;
    pub(crate) const ARRAY_STRIDE: u32 = 6;
    pub(crate) const BUILT_IN: u32 = 11;
    pub(crate) const FLAT: u32 = 14;
    pub(crate) const SAMPLE: u32 = 17;
    pub(crate) const LOCATION: u32 = 30;
    pub(crate) const COMPONENT: u32 = 31;
    pub(crate) const INDEX: u32 = 32;
    pub(crate) const BINDING: u32 = 33;
    pub(crate) const DESCRIPTOR_SET: u32 = 34;
    pub(crate) const OFFSET: u32 = 35;
    pub(crate) const PER_VERTEX: u32 = 5285;
}

/// What a variable decorated as built-in means.
pub(super) mod built_in {
    pub(crate) const PRIMITIVE_ID: u32 = 7;
    pub(crate) const FRAG_COORD: u32 = 15;
    pub(crate) const FRONT_FACING: u32 = 17;
    pub(crate) const SAMPLE_ID: u32 = 18;
    pub(crate) const SAMPLE_POSITION: u32 = 19;
    pub(crate) const SAMPLE_MASK: u32 = 20;
    pub(crate) const FRAG_DEPTH: u32 = 22;
    pub(crate) const INSTANCE_INDEX: u32 = 43;
    pub(crate) const PRIMITIVE_SHADING_RATE: u32 = 4432;
    pub(crate) const SHADING_RATE: u32 = 4444;
    pub(crate) const FRAG_SIZE: u32 = 5292;
    pub(crate) const FRAG_INVOCATION_COUNT: u32 = 5293;
}

/// Capabilities.
pub(super) mod capability {
    pub(crate) const GEOMETRY: u32 = 2;
    pub(crate) const TESSELLATION: u32 = 3;
    pub(crate) const SAMPLE_RATE_SHADING: u32 = 35;
    pub(crate) const PHYSICAL_STORAGE_BUFFER_ADDRESSES: u32 = 5347;
    pub(crate) const DEMOTE_TO_HELPER_INVOCATION: u32 = 5379;
}

/// Version words of a module's header.
pub(super) mod version {
    pub(crate) const V1_3: u32 = 0x0001_0300;
    pub(crate) const V1_4: u32 = 0x0001_0400;
    pub(crate) const V1_5: u32 = 0x0001_0500;
}
