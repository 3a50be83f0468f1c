#include "ext.hpp"
using F=Fidelity;
// S7 angular momentum of damped circular ringing
TEST(S,7b){Scene s;double R=0.1;for(int k=0;k<3;++k)for(int c=0;c<3;++c)point(s,k==1?2.:1.,{k-1.0,R*std::cos(2*M_PI*c/3),R*std::sin(2*M_PI*c/3)});
  for(int k=0;k<3;++k)for(int c=0;c<3;++c)link(s,{3*k+c,3*k+(c+1)%3},Spring{2e4});
  for(int k=0;k<2;++k)for(int c=0;c<3;++c){link(s,{3*k+c,3*k+3+c},Spring{2e4});link(s,{3*k+c,3*k+3+(c+1)%3},Spring{2e4});link(s,{3*k+c,3*k+3+(c+2)%3},Spring{2e4});}
  publish_all(s);auto S_=st(s);double w=S_->omega[1];std::printf("omega %g %g %g max %g\n",S_->omega[0],S_->omega[1],S_->omega[2],S_->omega.maxCoeff());
  s.rate=S_->omega.maxCoeff()/0.5;s.damping.modal_ratio=0.01;for(double q:{4e-3}){s.initial.points.clear();add_mode(s,*S_,1,q,0);add_mode(s,*S_,2,0,q*w);
  Load L;L.axes=Axes::kWorld;double f=0.5e-3*w*w;for(int c=0;c<3;++c){L.forces.push_back({c,{0,f,0}});L.forces.push_back({3+c,{0,-2*f,0}});L.forces.push_back({6+c,{0,f,0}});}s.loads={L};
  std::vector<double> t;for(double x:{600.,3000.,4500.,6000.})t.push_back(x/w);
  show("S7",s,s,t,{F::kCoupled,F::kExactBars});}}
TALLY
