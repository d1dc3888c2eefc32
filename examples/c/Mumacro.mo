package Mumacro "Macroscopic friction of an oscillated sliding contact, by mumacro.h"
  pure function muMacro "mu_macro, smooth in each regime; NaN where an input is illegal"
    input Real mu0(min=0) "Coulomb friction coefficient";
    input Real Fz(unit="N") "normal force";
    input Real k(unit="N/m") "tangential stiffness";
    input Real y0(unit="m") "amplitude of the transverse oscillation";
    input Real omega(unit="rad/s") "its angular frequency";
    input Real v0(unit="m/s") "sliding speed, >= 0";
    output Real mu "macroscopic friction coefficient";
  external "C" mu = mumacro_mu_macro(mu0, Fz, k, y0, omega, v0)
    annotation (Include = "#include \"mumacro.h\"", IncludeDirectory = "modelica://Mumacro");
    annotation (derivative = muMacro_der);
  end muMacro;

  pure function muMacro_der "its derivative along a direction of the inputs"
    input Real mu0, Fz, k, y0, omega, v0;
    input Real der_mu0, der_Fz, der_k, der_y0, der_omega, der_v0;
    output Real der_mu;
  protected
    Real g[6];
  algorithm
    g := gradient(mu0, Fz, k, y0, omega, v0);
    der_mu := g*{der_mu0, der_Fz, der_k, der_y0, der_omega, der_v0};
  end muMacro_der;

  pure function gradient "d mu_macro / d (mu0, Fz, k, y0, omega, v0)"
    input Real mu0, Fz, k, y0, omega, v0;
    output Real g[6];
  external "C" mumacro_modelica_gradient(mu0, Fz, k, y0, omega, v0, g)
    annotation (Include = "#include \"mumacro_modelica.h\"", IncludeDirectory = "modelica://Mumacro");
  end gradient;

  pure function force "friction force [N] at a velocity of either sign, a steep damper below v_rest"
    input Real v(unit="m/s") "sliding velocity";
    input Real v_rest(unit="m/s") "below it the force is regularised, > 0";
    input Real mu0(min=0), Fz(unit="N"), k(unit="N/m"), y0(unit="m"), omega(unit="rad/s");
    output Real F(unit="N") "along v";
  external "C" F = mumacro_force(v, v_rest, mu0, Fz, k, y0, omega)
    annotation (Include = "#include \"mumacro.h\"", IncludeDirectory = "modelica://Mumacro");
  end force;

  model SlidingMass "a mass that is pulled over an oscillated contact: m dv/dt = F - friction"
    parameter Real m(unit="kg") = 1.0;
    parameter Real F(unit="N") = 2.7;
    parameter Real Fz(unit="N") = 10.0;
    parameter Real v_rest(unit="m/s") = 1e-4;
    Real v(unit="m/s", start = 0.01, fixed = true);
  equation
    m*der(v) = F - force(v, v_rest, 0.3, Fz, 1e6, 2e-6, 1.3e5);
  end SlidingMass;
end Mumacro;
