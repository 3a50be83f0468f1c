#include "ext.hpp"
using F=Fidelity;
// S4: line of 3: springs soft, dashpots strong carry the end load while bending rings
TEST(S,4){for(double c:{3e4})for(double Fx:{0.5,2.0,8.0}){Scene s;for(int k=0;k<3;++k)point(s,1+0.2*k,{1.0*k,0,0});
  for(int k=0;k<2;++k){link(s,{k,k+1},Spring{3e3});link(s,{k,k+1},Dashpot{c});}
  link(s,{0,1,2},BendingSpring{100.});publish_all(s);s.rate=500;auto S_=st(s);double w=lowest_of(*S_),P=2*M_PI/w;
  add_mode(s,*S_,0,1e-3,0);Load L;L.axes=Axes::kBody;L.forces={{0,{-Fx,0,0}},{2,{Fx,0,0}}};s.loads={L};
  std::vector<double> t;for(double x:{0.5,1.2,2.3,4.4,6.3,9.2,14.1,20.})t.push_back(x*P);
  std::printf("P %g\n",P);show("S4 c "+std::to_string(c)+" F "+std::to_string(Fx),s,s,t,{F::kSeparated,F::kCoupled});}}
// S4b: the same, springs at 30 N/m: the dashpots carry the load for hundreds of s
TEST(S,4b){for(double Fx:{1.,4.}){Scene s;for(int k=0;k<3;++k)point(s,1+0.2*k,{1.0*k,0,0});
  for(int k=0;k<2;++k){link(s,{k,k+1},Spring{300});link(s,{k,k+1},Dashpot{1e5});}
  link(s,{0,1,2},BendingSpring{30.});publish_all(s);s.rate=200;auto S_=st(s);double w=lowest_of(*S_),P=2*M_PI/w;
  add_mode(s,*S_,0,1e-3,0);Load L;L.axes=Axes::kBody;L.forces={{0,{-Fx,0,0}},{2,{Fx,0,0}}};s.loads={L};
  std::vector<double> t;for(double x:{0.5,1.2,2.3,4.4,6.3,9.2,14.1,20.})t.push_back(x*P);
  show("S4b F "+std::to_string(Fx),s,s,t,{F::kSeparated});}}
// S6: full rung, beams and a strong dashpot, tiny amplitude
TEST(S,6){for(double c:{10.,100.,1000.,3e4}){Scene s;for(int k=0;k<4;++k)point(s,1.,{1.0*k,0.1*(k%2),0.05*k*k});for(int k=0;k<3;++k)link(s,{k,k+1},Beam{.EA=1e4,.GJ=100,.EI_y=100,.EI_z=120,.y_axis=Vector3d(0,0.2,1)});
  link(s,{0,3},Dashpot{c});publish_all(s);s.rate=200;auto S_=st(s);double w=lowest_of(*S_),P=2*M_PI/w;add_mode(s,*S_,0,1e-5,0);add_mode(s,*S_,1,1e-5,0);
  std::vector<double> t;for(double x:{0.1,0.3,0.5,1.2,2.3,4.4})t.push_back(x*P);
  show("S6 c "+std::to_string(c),s,s,t,{F::kSeparated,F::kCoupled,F::kExactBars,F::kFull});}}
TALLY
