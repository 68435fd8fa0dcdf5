//! Keeps the library loadable by glibc 2.28 (RHEL 8), whatever newer glibc it is linked against.
//!
//! A linker binds a function of the C library to its newest version, `pthread_create@GLIBC_2.34` for instance, which
//! older systems do not have. Each function below replaces one that the standard library of Rust calls, and jumps to
//! its version of 2002, which every glibc for x86-64 has. Only on x86-64; wheels for AArch64 come from `tests/wheels.py`.

/// A function that jumps to version 2.2.5 of the same function.
macro_rules! oldest {
    ($($name:literal),*) => {
        $(core::arch::global_asm!(
            concat!(".symver ", $name, "_2_2_5, ", $name, "@GLIBC_2.2.5"),
            concat!(".globl ", $name, "\n.hidden ", $name, "\n.type ", $name, ", @function"),
            concat!($name, ": jmp ", $name, "_2_2_5@PLT"),
        );)*
    };
}

oldest!(
    "dlsym",
    "hypot",
    "log",
    "pow",
    "pthread_attr_getguardsize",
    "pthread_attr_getstack",
    "pthread_attr_setstacksize",
    "pthread_create",
    "pthread_detach",
    "pthread_getattr_np",
    "pthread_join",
    "pthread_key_create",
    "pthread_key_delete",
    "pthread_setspecific"
);

// stat64(path, out) and fstat64(handle, out) are __xstat64(1, path, out) and __fxstat64(1, handle, out) before 2.33;
// gettid() is system call 186 before 2.30.
core::arch::global_asm!(
    ".symver __xstat64_2_2_5, __xstat64@GLIBC_2.2.5",
    ".symver __fxstat64_2_2_5, __fxstat64@GLIBC_2.2.5",
    ".symver pthread_setname_np_2_12, pthread_setname_np@GLIBC_2.12",
    ".globl stat64, fstat64, pthread_setname_np",
    ".weak gettid", // Rust refers to it weakly
    ".hidden stat64, fstat64, gettid, pthread_setname_np",
    ".type stat64, @function",
    ".type fstat64, @function",
    ".type gettid, @function",
    ".type pthread_setname_np, @function",
    "stat64: mov rdx, rsi",
    "mov rsi, rdi",
    "mov edi, 1",
    "jmp __xstat64_2_2_5@PLT",
    "fstat64: mov rdx, rsi",
    "mov esi, edi",
    "mov edi, 1",
    "jmp __fxstat64_2_2_5@PLT",
    "gettid: mov eax, 186",
    "syscall",
    "ret",
    "pthread_setname_np: jmp pthread_setname_np_2_12@PLT",
);
