/* The handler that JAX calls, by the C interface of XLA (third_party/xla/ffi/api/c_api.h).
 *
 * Arguments: v~ and y~, or the six inputs, float64 of one shape.  Attributes: `order` 0, 1 or 2 of the derivative,
 * `quantity`, `table`, the id of an open table.  Results of the same shape: the value; the derivatives along every
 * argument; of v~ and y~ also d2/dv~2, d2/dv~ dy~, d2/dy~2. */
#include <string.h>

#include "export.h"
#include "library.h"
#include "xla/ffi/api/c_api.h"

enum { MU_TABLES = 64, MU_MANY = 256 };
static const mumacro_data *mu_tables[MU_TABLES];
static int64_t mu_ids[MU_TABLES];
static int mu_open; /* tables before this one are complete */
static const mumacro_kernel *mu_best;

MU_EXPORT int mumacro_xla_open(int64_t id, const mumacro_data *data) {
    const int n = mu_open; /* the caller lets one thread at a time in */
    if (n == MU_TABLES) return 1;
    for (int level = 0; level < 3; ++level)
        if (mumacro_kernel_at(level)) mu_best = mumacro_kernel_at(level);
    mu_tables[n] = data;
    mu_ids[n] = id;
    __atomic_store_n(&mu_open, n + 1, __ATOMIC_RELEASE);
    return 0;
}

static const mumacro_data *mu_table_of(int64_t id) {
    const int n = __atomic_load_n(&mu_open, __ATOMIC_ACQUIRE);
    for (int i = 0; i < n; ++i)
        if (mu_ids[i] == id) return mu_tables[i];
    return NULL;
}

static XLA_FFI_Error *mu_refuse(const XLA_FFI_CallFrame *frame, const char *message) {
    XLA_FFI_Error_Create_Args args = {XLA_FFI_Error_Create_Args_STRUCT_SIZE, NULL, NULL,
                                      XLA_FFI_Error_Code_INVALID_ARGUMENT};
    args.message = message;
    return frame->api->XLA_FFI_Error_Create(&args);
}

/* A whole number among the attributes; -1 where it is missing. */
static int64_t mu_attribute(const XLA_FFI_Attrs *attrs, const char *name) {
    for (int64_t i = 0; i < attrs->size; ++i) {
        const XLA_FFI_Scalar *scalar = (const XLA_FFI_Scalar *)attrs->attrs[i];
        if (attrs->types[i] == XLA_FFI_AttrType_SCALAR && attrs->names[i]->len == strlen(name) &&
            !memcmp(attrs->names[i]->ptr, name, strlen(name)) && scalar->dtype == XLA_FFI_DataType_S64) {
            int64_t value;
            memcpy(&value, scalar->value, sizeof value);
            return value;
        }
    }
    return -1;
}

/* The number of float64 in a buffer; -1 where it holds something else. */
static int64_t mu_numbers(const void *given) {
    const XLA_FFI_Buffer *buffer = (const XLA_FFI_Buffer *)given;
    int64_t n = 1;
    if (buffer->dtype != XLA_FFI_DataType_F64) return -1;
    for (int64_t i = 0; i < buffer->rank; ++i) n *= buffer->dims[i];
    return n;
}

/* The value or the six derivatives of cases, in pieces that fit on the stack. */
static void mu_cases_of(const mumacro_kernel *kernel, const mumacro_data *data, int order, int64_t n,
                        const double *const *in, double *const *out) {
    const int64_t one[6] = {1, 1, 1, 1, 1, 1};
    for (int64_t start = 0; start < n; start += MU_MANY) {
        const int64_t few = n - start < MU_MANY ? n - start : MU_MANY;
        double rows[17 * MU_MANY];
        int8_t source[MU_MANY];
        const double *columns[6];
        for (int i = 0; i < 6; ++i) columns[i] = in[i] + start;
        kernel->cases(data, 0, 0, few, columns, one, order ? 17 : 3, rows, MU_MANY, source);
        for (int i = 0; i < (order ? 6 : 1); ++i)
            memcpy(out[i] + start, rows + (order ? 5 + i : 0) * MU_MANY, (size_t)few * sizeof *rows);
    }
}

static XLA_FFI_Error *mu_run(const XLA_FFI_CallFrame *frame) {
    const mumacro_data *data = mu_table_of(mu_attribute(&frame->attrs, "table"));
    const mumacro_kernel *kernel = mu_best; /* set before the first table */
    const int64_t order = mu_attribute(&frame->attrs, "order"), code = mu_attribute(&frame->attrs, "quantity");
    const int64_t given = frame->args.size, wanted = frame->rets.size;
    const int64_t n = given > 0 ? mu_numbers(frame->args.args[0]) : -1;
    const double *in[6];
    double *out[6];
    if (!data) return mu_refuse(frame, "mumacro: this table is not open here: make a mumacro.jax.Friction of it first");
    if (!(given == 2 || (given == 6 && order < 2)) || order < 0 || order > 2 || code < 0 ||
        code >= kernel->atlas->quantities || wanted != (order == 0 ? 1 : order == 1 ? given : 3))
        return mu_refuse(frame, "mumacro: not a call that mumacro.jax makes");
    for (int64_t i = 0; i < given + wanted; ++i) {
        void *buffer = i < given ? frame->args.args[i] : frame->rets.rets[i - given];
        if (n < 0 || mu_numbers(buffer) != n) return mu_refuse(frame, "mumacro: needs float64 of one shape");
        if (i < given) in[i] = (const double *)((XLA_FFI_Buffer *)buffer)->data;
        else out[i - given] = (double *)((XLA_FFI_Buffer *)buffer)->data;
    }
    if (given == 6) mu_cases_of(kernel, data, (int)order, n, in, out);
    else if (order == 0) kernel->values(data, 0, 0, (int)code, n, in[0], in[1], out[0], NULL, NULL);
    else if (order == 1) kernel->partials(data, (int)code, n, in[0], in[1], out[0], out[1]);
    else kernel->bends(data, (int)code, n, in[0], in[1], out[0], out[1], out[2]);
    return NULL;
}

static XLA_FFI_Error *mu_handle(XLA_FFI_CallFrame *frame) {
    for (XLA_FFI_Extension_Base *one = frame->extension_start; one; one = one->next) {
        if (one->type == XLA_FFI_Extension_Metadata) { /* asked once, when the handler is registered */
            XLA_FFI_Metadata *about = ((XLA_FFI_Metadata_Extension *)one)->metadata;
            about->api_version.major_version = XLA_FFI_API_MAJOR;
            about->api_version.minor_version = XLA_FFI_API_MINOR;
            about->traits = 0;
            return NULL;
        }
    }
    return frame->stage == XLA_FFI_ExecutionStage_EXECUTE ? mu_run(frame) : NULL;
}

MU_EXPORT void *mumacro_xla_handler(void) {
    XLA_FFI_Handler *handler = mu_handle;
    void *address;
    memcpy(&address, &handler, sizeof address);
    return address;
}
