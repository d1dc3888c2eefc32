# mumacro.h in Julia: gcc -O2 -std=gnu99 -march=native -shared -fPIC mumacro.c mumacro_table.c -o libmumacro.so -lm
struct Answer
    mu_macro::Cdouble; mu_ratio::Cdouble; error_bound::Cdouble; v_tilde::Cdouble; y_tilde::Cdouble
    source::Cint; regime::Cint
    gradient::NTuple{6,Cdouble}; gradient_bound::NTuple{6,Cdouble}
end

const lib = joinpath(@__DIR__, "libmumacro")

mu_ratio(v, y) = ccall((:mumacro_mu_ratio, lib), Cdouble, (Cdouble, Cdouble), v, y)

function evaluate(mu0, Fz, k, y0, omega, v0)
    answer = Ref{Answer}()
    error = ccall((:mumacro_evaluate, lib), Cint,
                  (Cdouble, Cdouble, Cdouble, Cdouble, Cdouble, Cdouble, Ref{Answer}), mu0, Fz, k, y0, omega, v0, answer)
    error == 0 || throw(DomainError((mu0, Fz, k, y0, omega, v0), "input $error is illegal"))
    return answer[]
end

println(evaluate(0.3, 10, 1e6, 2e-6, 1.3e5, 0.01).mu_macro, " ", mu_ratio.([0.1, 1.0], 0.5))
