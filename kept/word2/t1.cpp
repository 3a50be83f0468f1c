#include "ext.hpp"
using F=Fidelity;
std::vector<PointLoad> tri(double f){return {{0,{0.5*f,f,0.2*f}},{1,{-f,-2*f,-0.4*f}},{2,{0.5*f,f,0.2*f}}};}
// S1 the test's own scene with the loads as a command
TEST(S,1){Scene s=cross7(0.1);auto S_=st(s);double w=lowest_of(*S_),spin=0.01*w,f=2e-3*w*w;s.initial.angular_velocity=spin*axis_of(*S_,1);
  Scene truth=s;Load L;L.axes=Axes::kWorld;L.forces=tri(f);truth.loads={L};
  ForceCommand c=make_command(0,1,Axes::kWorld);for(auto&p:L.forces)add_force(c,p.point,p.force);
  std::vector<double> t;for(double x:{0.3,1.,1.5,2.,2.5,3.,3.5,4.})t.push_back(x/spin);
  show("S1 as load",truth,truth,t,{F::kSpinLoaded});
  show("S1 as command",truth,s,t,{F::kSpinLoaded,F::kSeparated},{{0.0,c}});}
// S2 phi first, then a world pulse that rings on
TEST(S,2){Scene s=cross7(0.005);auto S_=st(s);double w=lowest_of(*S_),spin=0.01*w,f=2e-3*w*w,P=2*M_PI/w;s.initial.angular_velocity=spin*axis_of(*S_,1);
  Load L;L.axes=Axes::kWorld;L.forces=tri(f);L.history=PulseHistory{0,1.5/spin};s.loads={L};
  double t0=4.5/spin;Load M=L;M.forces=tri(f);M.history=PulseHistory{t0,0.5*P};s.loads.push_back(M);
  std::vector<double> t;for(double x:{1.,2.,3.,4.})t.push_back(x/spin);for(double x:{0.3,0.7,1.2,2.3,3.4,5.2,8.1})t.push_back(t0+x*P);
  show("S2",s,s,t,{F::kSpinLoaded,F::kSeparated});}
// S3 world sine at resonance
TEST(S,3){Scene s=cross7(0.01);auto S_=st(s);double w=lowest_of(*S_),spin=0.01*w,f=2e-3*w*w;s.initial.angular_velocity=spin*axis_of(*S_,1);
  Load L;L.axes=Axes::kWorld;L.forces=tri(f);L.history=PulseHistory{0,1.5/spin};s.loads={L};
  Load M=L;M.forces=tri(0.1*f);M.history=SineHistory{w/(2*M_PI),0};s.loads.push_back(M);
  std::vector<double> t;for(double x:{1.,2.,2.5,3.,3.3,3.6,4.,4.3,4.6,5.})t.push_back(x/spin);
  show("S3",s,s,t,{F::kSpinLoaded});}
TALLY
