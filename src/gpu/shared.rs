//! How records and numbers that host and shaders share are declared: in Rust, which WGSL is generated from (layout.rs has them all).

/// Rust types of record fields and their WGSL names.
macro_rules! wgsl_type {
    (u32) => {
        "u32"
    };
    (f32) => {
        "f32"
    };
    (Vec4) => {
        "vec4f"
    };
    (UVec4) => {
        "vec4u"
    };
}

/// Declares records that host and shaders share, and `WGSL_RECORDS`, their declarations for the shaders.
macro_rules! shared_records {
    ($($(#[$doc:meta])* struct $name:ident { $($(#[$field_doc:meta])* $field:ident: $kind:ident,)* })*) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
            #[repr(C)]
            pub struct $name { $($(#[$field_doc])* pub $field: $kind,)* }
        )*

        /// WGSL declarations of all records.
        pub const WGSL_RECORDS: &str = concat!($("struct ", stringify!($name), " {\n",
            $("    ", stringify!($field), ": ", wgsl_type!($kind), ",\n",)* "}\n",)*);

        /// Name and WGSL type of every field of every record.
        pub(super) const FIELDS: &[(&str, &[(&str, &str)])] =
            &[$((stringify!($name), &[$((stringify!($field), wgsl_type!($kind)),)*]),)*];

        /// Name, size and (field, offset) list of every record, as Rust lays them out.
        pub fn record_layouts() -> Vec<(&'static str, usize, Vec<(&'static str, usize)>)> {
            vec![$((stringify!($name), std::mem::size_of::<$name>(),
                vec![$((stringify!($field), std::mem::offset_of!($name, $field)),)*]),)*]
        }
    };
}

/// Declares numbers that host and shaders share, and `WGSL_CONSTANTS`.
macro_rules! shared_constants {
    ($($(#[$doc:meta])* $name:ident = $value:literal;)*) => {
        $($(#[$doc])* pub const $name: u32 = $value;)*

        /// WGSL declarations of all shared numbers.
        pub const WGSL_CONSTANTS: &str = concat!($("const ", stringify!($name), " = ", stringify!($value), "u;\n",)*);
    };
}

pub(super) use {shared_constants, shared_records, wgsl_type};
