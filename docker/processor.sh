# For which processors kernels are compiled: sourced by install.sh and start.sh.
#
# numba keys its cache by the processor's name and features, so code for the one that the image was
# made on would be compiled anew on most others.  x86-64-v3 is what nearly all since 2013 to 2015
# have (AVX2, FMA); what lacks it, or is no x86-64, compiles for itself, once.  So does one that is
# told to by an empty NUMBA_CPU_NAME.

if [ "${NUMBA_CPU_NAME-unset}" = unset ]; then
    if /lib64/ld-linux-x86-64.so.2 --help 2>/dev/null | grep -q 'x86-64-v3 (supported'; then
        export NUMBA_CPU_NAME=x86-64-v3 NUMBA_CPU_FEATURES=
    fi
elif [ -z "$NUMBA_CPU_NAME" ]; then
    unset NUMBA_CPU_NAME NUMBA_CPU_FEATURES
fi
